"""Values combined in a tree: the same tree everywhere, and what happens where a task or a combination fails."""

from __future__ import annotations

from collections.abc import Iterator

import distributed
import pytest
from refusals import refused
from worker_tasks import failing, letter, paired, process, unpaired

from flexcal.parallel import ThisProcess, Workers, consecutive_groups, open_workers


@pytest.fixture(params=["this process", "processes", "Dask"], scope="module")
def workers(request: pytest.FixtureRequest, dask_cluster: distributed.LocalCluster) -> Iterator[Workers]:
    address = dask_cluster.scheduler_address.replace("tcp://", "dask://")
    with open_workers(
        address if request.param == "Dask" else None, 1 + (request.param == "processes")
    ) as one:
        yield one


def test_neighbours_are_combined_first(workers: Workers) -> None:
    groups = [[0], [0, 1], range(3), range(5), range(7), range(11)]
    assert list(workers.reduced(letter, groups, paired)) == [
        "a",
        "(ab)",
        "((ab)c)",
        "(((ab)(cd))e)",
        "(((ab)(cd))((ef)g))",
        "((((ab)(cd))((ef)(gh)))((ij)k))",
    ]


def test_groups_are_of_neighbours() -> None:
    assert consecutive_groups(range(7), 3) == [range(2), range(2, 5), range(5, 7)]
    assert consecutive_groups("ab", 3) == ["a", "b"]


@pytest.mark.slow
def test_few_long_tasks_are_shared_out(workers: Workers) -> None:
    """The first worker has what tasks have in common: for the scheduler that must not be a reason to give it all of them."""
    each = list(workers.values(process, range(4)))
    joined = list(workers.reduced(process, [range(4)], set.union))
    assert len(set.union(*each)) == len(joined[0]) == workers.count


def test_values_come_in_the_order_of_the_tasks(workers: Workers) -> None:
    assert list(workers.values(letter, range(12))) == list("abcdefghijkl")


def test_an_error_of_a_task_or_a_combination_is_raised(workers: Workers) -> None:
    with refused("E-CAL-900"):
        list(workers.values(failing, range(4)))
    with refused("E-CAL-900"):
        list(workers.reduced(failing, [range(4)], max))
    with refused("E-CAL-901"):
        list(workers.reduced(letter, [range(4)], unpaired))
    assert list(workers.values(letter, range(2))) == ["a", "b"]


def test_an_unexpected_exception_is_raised_too(workers: Workers) -> None:
    if isinstance(workers, ThisProcess):
        with pytest.raises(ValueError, match="no"):
            list(workers.values(failing, [3]))
    else:
        with refused("E-WORK-007", "ValueError"):
            list(workers.values(failing, [3]))
