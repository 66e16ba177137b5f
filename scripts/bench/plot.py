"""A line chart as SVG, written directly so that equal numbers give equal files."""

WIDTH, HEIGHT = 760, 400
LEFT, RIGHT, TOP, BOTTOM = 70, 210, 44, 56
COLOURS = ["#555555", "#0072b2", "#d55e00", "#009e73", "#cc79a7"]


def chart(title, x_label, y_label, x_values, series):
    """`series`: (name, {x: y}) in the order of the colours. The x values stand at equal distances."""
    top = nice_top(max(y for _, points in series for y in points.values()))
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def at(x, y):
        share = x_values.index(x) / max(len(x_values) - 1, 1)
        return LEFT + share * width, TOP + height * (1 - y / top)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        'font-family="sans-serif" font-size="13" fill="#222">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        text(LEFT, 24, title, "start", 'font-size="15"'),
        text(LEFT + width / 2, HEIGHT - 12, x_label),
        text(0, 0, y_label, "middle", f'transform="translate(16 {TOP + height / 2:.1f}) rotate(-90)"'),
    ]
    for step in range(6):
        value = top * step / 5
        _, y = at(x_values[0], value)
        parts.append(f'<line x1="{LEFT}" x2="{LEFT + width}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>')
        parts.append(text(LEFT - 8, y + 4, f"{value:.0f}", "end"))
    for x in x_values:
        parts.append(text(at(x, 0)[0], TOP + height + 20, str(x)))
    labels = []
    for (name, points), colour in zip(series, COLOURS):
        places = [at(x, y) for x, y in points.items()]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>' for x, y in places]
        labels.append([places[-1][1] + 4, places[-1][0] + 10, name, colour])
    for label, below in zip(spread(labels), labels):
        parts.append(text(below[1], label, below[2], "start", f'style="fill:{below[3]}"'))
    return "\n".join([*parts, "</svg>", ""])


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
