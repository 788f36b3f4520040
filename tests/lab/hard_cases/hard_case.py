"""What every hard case has to do, whatever it tries; its own tests file says the rest."""

import json

from viscopade_lab.hard_cases import Finding, from_json

ROWS, CURVES = 40, 8  # that people read, in a table and in a chart of the quick run


def assert_passes(result):
    failing = [(check.statement, check.measured, check.limit) for check in result.checks if not check.holds]
    assert not failing


def assert_readable(result):
    assert all(0 < len(table.rows) <= ROWS for table in result.tables)
    assert all(len(chart.curves) <= CURVES for chart in result.charts)


def assert_goes_to_json_and_back(case, result):
    finding = Finding(case.name, case.title, case.question, False, result)
    assert from_json(json.dumps({"cases": [finding.to_json()]}), "test") == (finding,)


def assert_same_checks(thorough, quick):
    assert [check.statement for check in thorough.checks] == [check.statement for check in quick.checks]
