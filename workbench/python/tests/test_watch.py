"""A search can be watched and interrupted, and holds nobody up."""

import _thread
import threading
import time

import pytest
import truing


@pytest.fixture(scope="module")
def long_case() -> truing.Case:
    return next(truing.cases("triple", 1, seed=5, rows=6000))


def test_progress_is_told_while_other_threads_run(long_case: truing.Case) -> None:
    told: list[truing.Progress] = []
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.wait(0.01):
            ticks += 1

    thread = threading.Thread(target=tick)
    thread.start()
    begun = time.monotonic()
    truing.gap(long_case.model, long_case.log, progress=told.append)
    took = time.monotonic() - begun
    done.set()
    thread.join()
    assert told and told[-1].candidates > 0
    assert [one.seconds for one in told] == sorted(one.seconds for one in told)
    # Both cores are busy; a lock that is held would leave none.
    assert ticks > 10 * took, (ticks, took)


def test_an_interrupt_raises_within_half_a_second(long_case: truing.Case) -> None:
    sent = 0.0

    def interrupt() -> None:
        nonlocal sent
        sent = time.monotonic()
        _thread.interrupt_main()

    timer = threading.Timer(0.15, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        truing.gap(long_case.model, long_case.log)
    assert time.monotonic() - sent < 0.5


def test_an_error_of_a_watcher_ends_the_search(long_case: truing.Case) -> None:
    def stop(_: truing.Progress) -> None:
        raise StopIteration("enough")

    with pytest.raises(StopIteration, match="enough"):
        truing.gap(long_case.model, long_case.log, progress=stop)
