"""How runs are ended and recorded, which records stay, and how pages are written or compared."""

import json

from studies import measure, pages


def test_files_are_written_once_and_only_compared_where_asked(tmp_path):
    file = tmp_path / "page.md"
    assert [pages.write({file: "x"}, only_check) for only_check in (True, False, True)] == [1, 0, 0]
    assert pages.write({file: "y"}, only_check=True) == 1 and file.read_text() == "x"
    assert pages.write({file: None}, only_check=True) == 1 and file.exists()
    assert [pages.write({file: None}), pages.write({file: None}, only_check=True)] == [0, 0] and not file.exists()


def test_records_that_no_page_uses_are_dropped(records):
    first, second, third = ({"level": level, "seconds": 0.1 * level} for level in (1, 2, 3))
    records([first, second], "a")
    folder = records([third], "b")
    found = measure.kept(folder, [second])
    assert found == {folder / "a.jsonl": json.dumps(second) + "\n", folder / "b.jsonl": None}


def test_records_are_read_in_the_order_of_their_dates(records):
    dates = ["2026-01-02", "2026-01-03", "2026-01-01"]
    made = [{"provenance": {"date": date}} for date in dates]
    records(made[:2], "a")
    assert [record["provenance"]["date"] for record in measure.read(records(made[2:], "b"))] == sorted(dates)


def test_of_a_summary_only_the_tables_that_are_read_are_recorded():
    step = {"time": 1.0, "converged": True, "energy": -2.0}
    summary = {"energy": -1.0, "error": None, "work": {"a": 1}, "newton": [{"seconds": 1.0}], "steps": [step]}
    assert measure.shortened(summary, ()) == {"energy": -1.0, "error": None}
    short = measure.shortened(summary, ("work", "steps"))
    assert short == {"energy": -1.0, "error": None, "work": {"a": 1}, "steps": [{"time": 1.0, "converged": True}]}
    assert measure.shortened(None, ()) is None


def test_a_command_and_all_that_it_started_end_at_the_limit():
    assert measure.ended(["sh", "-c", "sleep 60 & sleep 60"], None, limit=0.1) == (None, "")
    assert measure.ended(["sh", "-c", "echo one; echo two >&2; exit 3"], None, limit=60) == (3, "one\ntwo\n")
    assert measure.ended(["echo", "one"], None, limit=None) == (0, "one\n")
