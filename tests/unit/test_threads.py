"""Threads: results in order, the error of the first item that fails, and what the caller does."""

import threading
import time

import pytest

from impactsig._running.threads import in_threads


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_come_in_the_order_of_the_items(threads):
    def late_if_even(k):
        time.sleep(0.002 * (k % 2 == 0))
        return k * k

    assert in_threads(late_if_even, range(9), threads) == [k * k for k in range(9)]
    assert in_threads(late_if_even, [], threads) == []


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_first_item_that_fails_tells_why_and_no_more_are_begun(threads):
    begun = []

    def fails(k):
        begun.append(k)
        time.sleep(0.002 * (k == 2))
        if k >= 2:
            raise ValueError(k)
        return k

    with pytest.raises(ValueError, match=r"^2$"):
        in_threads(fails, range(1000), threads)
    assert len(begun) < 3 + threads


def test_the_calling_thread_and_as_many_others_as_asked_for_work():
    names = set()
    together = threading.Barrier(3)

    def meets(_):
        names.add(threading.get_ident())
        together.wait(timeout=30)

    in_threads(meets, range(3), 3)
    assert len(names) == 3
    assert threading.get_ident() in names
    before = threading.active_count()
    in_threads(abs, range(3), 8)
    assert threading.active_count() == before


def test_an_interrupt_of_the_caller_ends_all_threads():
    begun = []

    def interrupted(k):
        begun.append(k)
        time.sleep(0.002)
        if threading.current_thread() is threading.main_thread():
            raise KeyboardInterrupt
        return k

    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        in_threads(interrupted, range(1000), 2)
    assert threading.active_count() == before
    assert len(begun) < 10
