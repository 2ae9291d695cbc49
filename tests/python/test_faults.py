"""A few runs of every fault; `faults.py` makes the whole table of docs/reliability.md."""

import pytest

import faults

RUNS = {"flip": 12, "truncate": 12, "damage": 12, "kill": 6, "interrupt": 6, "stall": 2}


@pytest.mark.parametrize("name", faults.FAULTS)
def test_a_fault_ends_in_a_correct_output_or_a_clear_error(name):
    for about, tally in faults.run_faults([name], seed=1, runs=RUNS.get(name, 4)):
        assert tally.counts["runs"] > 0, about
        assert tally.is_clean, (about, tally.problems)
