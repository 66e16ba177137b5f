"""Wider bodies, so that more ranks have the same work each."""

import pathlib
import sys

from .measure import ROOT

Y = 1


def options(scene, factor):
    """Options of `fetiplast` that make every brick of a scene so many times as long, with as many times the cells, along y.
    Loads per area and supports go along; the bodies keep their places to each other."""
    import tomllib

    file = ROOT / "src" / "scene" / "library" / f"{scene}.toml"
    text = (file if file.exists() else pathlib.Path(scene)).read_text()
    found = []
    for name, body in tomllib.loads(text)["body"].items():
        if "brick" not in body:
            sys.exit(f"scripts/study: body.{name} of {scene} is no brick: a weak study widens bricks")
        for key in ("origin", "size", "cells"):
            found += ["--set", f"body.{name}.brick.{key}.{Y}={factor * body['brick'][key][Y]}"]
    return found
