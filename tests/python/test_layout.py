"""The layout of the sources: rooms import downward only, files and functions stay short."""

import pathlib
import re
import statistics

ROOT = pathlib.Path(__file__).resolve().parents[2] / "src"
TESTS = {"tests.rs", "fixture.rs", "extension.rs", "random.rs", "orders.rs"}


def sources():
    """Path below src and code without tests and comments."""
    for path in sorted(ROOT.rglob("*.rs")):
        relative = path.relative_to(ROOT)
        if relative.name in TESTS | {"lib.rs", "main.rs"} or "tests" in relative.parts:
            continue
        code = path.read_text().split("#[cfg(test)]\nmod tests {")[0]
        yield relative, "\n".join(line for line in code.splitlines() if not line.strip().startswith("//"))


def room(parts):
    """A folder or file of src; those of feti count each."""
    inner = parts[0] == "feti" and len(parts) > 1 and (ROOT / "feti" / parts[1]).is_dir()
    return "/".join(parts[: 2 if inner else 1]).removesuffix(".rs")


def imports():
    """For each room the rooms that it names."""
    rooms = {}
    for path, code in sources():
        mine = room(path.parts)
        named = re.findall(r"crate::([a-z_]\w*(?:::[a-z_]\w*)*)", code)
        rooms.setdefault(mine, set()).update(other for name in named if (other := room(name.split("::"))) != mine)
    return rooms


def test_no_ring_of_rooms():
    left = {name: set(others) for name, others in imports().items()}
    while True:
        ground = {name for name, others in left.items() if not others & left.keys()}
        if not ground:
            break
        left = {name: others for name, others in left.items() if name not in ground}
    assert not left, f"these rooms import each other in a ring, or stand on one: {sorted(left)}"


def test_files_are_short():
    lengths = {path: len(path.read_text().splitlines()) for path in ROOT.rglob("*.rs")}
    assert statistics.median(lengths.values()) <= 130
    assert not {str(path.relative_to(ROOT)): n for path, n in lengths.items() if n > 400}
