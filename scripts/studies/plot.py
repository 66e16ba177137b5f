"""Charts as SVG, written directly so that equal numbers give equal files."""

import math

WIDTH, HEIGHT = 760, 400
LEFT, RIGHT, TOP, BOTTOM = 70, 210, 44, 56
ACROSS, UP = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
COLOURS = ["#555555", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#999933"]


def chart(title, x_label, y_label, x_values, series):
    """`series`: (name, {x: y}) in the order of the colours. The x values stand at equal distances."""
    top = nice_top(max(y for _, points in series for y in points.values()))

    def at(x, y):
        share = x_values.index(x) / max(len(x_values) - 1, 1)
        return LEFT + share * ACROSS, TOP + UP * (1 - y / top)

    rules = [(at(x_values[0], top * step / 5)[1], f"{top * step / 5:.0f}") for step in range(6)]
    marks = [(at(x, 0)[0], str(x)) for x in x_values]
    return drawn(frame(title, x_label, y_label, rules, marks), [(*of, False) for of in series], at)


def curves(title, x_label, y_label, series, y_top=None):
    """`series`: (name, {x: y}, dashed). Both axes are logarithmic; with `y_top` the vertical one goes in a straight line from
    zero to there."""
    xs = sorted({x for _, points, _ in series for x in points})
    ys = [y for _, points, _ in series for y in points.values()]
    x_ticks = xs if len(xs) <= 8 else decades(xs[0], xs[-1])
    y_ticks = [y_top * step / 5 for step in range(6)] if y_top else ticks(min(ys), max(ys))
    low, high = (0.0, y_top) if y_top else (math.log(min(y_ticks[0], *ys)), math.log(max(y_ticks[-1], *ys)))
    left, right = math.log(xs[0]), math.log(xs[-1])

    def at(x, y):
        along = (math.log(x) - left) / (right - left or 1)
        up = ((y if y_top else math.log(y)) - low) / (high - low or 1)
        return LEFT + along * ACROSS, TOP + UP * (1 - up)

    rules = [(at(xs[0], value)[1], number(value)) for value in y_ticks]
    marks = [(at(x, y_ticks[-1])[0], number(x)) for x in x_ticks]
    return drawn(frame(title, x_label, y_label, rules, marks), series, at)


def bars(title, x_label, y_label, columns):
    """Stacked bars. `columns`: (name, {part: height}); all have the same parts, the first lies at the bottom."""
    top = nice_top(1000 * max(sum(column.values()) for _, column in columns)) / 1000
    share = ACROSS / len(columns)
    rules = [(TOP + UP * (1 - step / 5), number(top * step / 5)) for step in range(6)]
    marks = [(LEFT + (place + 0.5) * share, name) for place, (name, _) in enumerate(columns)]
    parts, thick = frame(title, x_label, y_label, rules, marks), min(0.7 * share, 60)
    for (x, _), (_, column) in zip(marks, columns):
        done = 0.0
        for value, colour in zip(column.values(), COLOURS):
            tall = UP * value / top
            y = TOP + UP * (1 - done / top) - tall
            parts.append(f'<rect x="{x - thick / 2:.1f}" y="{y:.1f}" width="{thick:.1f}" height="{tall:.1f}" fill="{colour}"/>')
            done += value
    for place, (name, colour) in enumerate(zip(columns[0][1], COLOURS)):
        y = TOP + UP - 20 * place
        parts.append(f'<rect x="{LEFT + ACROSS + 12}" y="{y - 11:.1f}" width="12" height="12" fill="{colour}"/>')
        parts.append(text(LEFT + ACROSS + 30, y, name, "start"))
    return ended(parts)


def frame(title, x_label, y_label, rules, marks):
    """The paper, what is written around the axes, rules at heights and marks at places along x, with their words."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        'font-family="sans-serif" font-size="13" fill="#222">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        text(LEFT, 24, title, "start", 'font-size="15"'),
        text(LEFT + ACROSS / 2, HEIGHT - 12, x_label),
        text(0, 0, y_label, "middle", f'transform="translate(16 {TOP + UP / 2:.1f}) rotate(-90)"'),
    ]
    for y, word in rules:
        parts.append(f'<line x1="{LEFT}" x2="{LEFT + ACROSS}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>')
        parts.append(text(LEFT - 8, y + 4, word, "end"))
    return parts + [text(x, TOP + UP + 20, word) for x, word in marks]


def drawn(parts, series, at):
    """With the lines of the series, their points at the places that `at` gives, and their names."""
    labels = []
    for (name, points, dashed), colour in zip(series, COLOURS):
        places = [at(x, y) for x, y in sorted(points.items())]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        dash = ' stroke-dasharray="6 4"' if dashed else ""
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>')
        if not dashed:
            parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>' for x, y in places]
        labels.append([places[-1][1] + 4, places[-1][0] + 10, name, colour])
    for label, below in zip(spread(labels), labels):
        parts.append(text(below[1], label, below[2], "start", f'style="fill:{below[3]}"'))
    return ended(parts)


def ended(parts):
    return "\n".join([*parts, "</svg>", ""])


def decades(least, most):
    """The powers of ten in a range; where there are fewer than two, with their double and fivefold."""
    first, last = math.floor(math.log10(least)), math.ceil(math.log10(most))
    tens = [x for x in (10.0**k for k in range(first, last + 1)) if least <= x <= most]
    return tens if len(tens) > 1 else [x for x in ticks(least, most) if least <= x <= most]


def ticks(least, most):
    """Round numbers around a range: powers of ten, where there are few with their double and fivefold."""
    first, last = math.floor(math.log10(least)), math.ceil(math.log10(most))
    steps = (1, 2, 5) if last - first <= 2 else (1,)
    all_of_them = [s * 10.0**k for k in range(first, last + 1) for s in steps]
    below = [x for x in all_of_them if x <= least]
    above = [x for x in all_of_them if x >= most]
    return [x for x in all_of_them if below[-1] <= x <= above[0]]


def number(value):
    """Short: thousands as k and millions as M."""
    for size, letter in ((1e6, "M"), (1e3, "k")):
        if value >= 10 * size or (value >= size and value % size == 0):
            return f"{value / size:g}{letter}"
    return f"{value:.3g}"


def spread(labels, distance=17):
    """Heights of the labels, pushed upwards where they would overlap; the lowest stays."""
    heights = [label[0] for label in labels]
    order = sorted(range(len(labels)), key=lambda i: -heights[i])
    for below, above in zip(order, order[1:]):
        heights[above] = min(heights[above], heights[below] - distance)
    return heights


def text(x, y, content, anchor="middle", more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {more}>{content}</text>'


def nice_top(value):
    """The smallest 1, 2, 3, 4, 5, 6, 8 or 10 times a power of ten that is not below the value."""
    power = 1
    while power * 10 < value:
        power *= 10
    return next(step * power for step in (1, 2, 3, 4, 5, 6, 8, 10) if step * power >= value)
