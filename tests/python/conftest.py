import json
import pathlib

import pytest


def pytest_addoption(parser):
    parser.addoption("--result", type=pathlib.Path, help="a result file of fetiplast, to be read back")


@pytest.fixture
def result(request):
    file = request.config.getoption("--result")
    if file is None:
        pytest.skip("needs --result FILE.vtkhdf")
    return file


@pytest.fixture
def records(tmp_path):
    """Writes records to a file in a folder, which it returns."""

    def write(records, name="a"):
        (tmp_path / f"{name}.jsonl").write_text("".join(json.dumps(record) + "\n" for record in records))
        return tmp_path

    return write
