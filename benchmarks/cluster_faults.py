"""Workers and schedulers that are killed while they render: part of benchmarks/faults.py.

Every process is one of its own: a scheduler, two workers of a thread each, and the command. Nothing here imports
distributed, whose threads no fork would survive.
"""

from __future__ import annotations

import multiprocessing
import random
import signal
import tempfile
import time
from pathlib import Path

from fault_trials import Ended, Running, Trials, Work, recover
from local_cluster import LocalCluster

NOT_KNOWN = float("nan")
LOOK_EVERY = 0.005
"""Seconds between looks at how many passes there are."""
TRIES = 4
"""Trials made, at most, for each one that counts."""


def worker_killed(work: Work, count: int, chance: random.Random) -> Trials:
    """One of two workers: the render must end as if nothing had been, to the bit.

    To recover is the longest time that passed without a new pass in the picture from then on, counted from the kill.
    """
    trials = Trials("kill -9 of one of two workers")
    for _ in range(count):
        with tempfile.TemporaryDirectory(dir=work.folder) as name, LocalCluster(Path(name), 2) as cluster:
            _wait_for_workers(cluster)
            out = Path(name, "out.npz")
            running = work.render(out, scheduler=cluster.address)
            kill_at = chance.uniform(0.05, 0.8) * work.passes
            _wait_for_passes(running, kill_at)
            cluster.workers[0].send_signal(signal.SIGKILL)
            ended, longest = _watched(running, work.passes)
            trials.count += 1
            trials.lost.append(0 if ended.status == 0 else work.passes)
            trials.recovery.append((longest, NOT_KNOWN))
            if ended.status != 0 or ended.said:
                trials.broken.append(f"status {ended.status}: {ended.said}")
            else:
                trials.wrong += work.wrong_pixels(out, tolerance=0)
    return trials


def scheduler_killed(work: Work, count: int, chance: random.Random) -> Trials:
    """The command says so in one line and keeps what is done; a second run goes on without a cluster.

    Where everything was back before the kill the picture must be right, and the trial is made again.
    """
    trials = Trials("kill -9 of the scheduler")
    for _ in range(TRIES * count):
        if trials.count == count:
            break
        with tempfile.TemporaryDirectory(dir=work.folder) as name, LocalCluster(Path(name), 2) as cluster:
            _wait_for_workers(cluster)
            out = Path(name, "out.npz")
            running = work.render(out, scheduler=cluster.address)
            _wait_for_passes(running, chance.uniform(0.05, 0.8) * work.passes)
            before, finished = running.seconds(), running.finished
            cluster.scheduler.send_signal(signal.SIGKILL)
            ended = running.end()
            if ended.status == 0:
                trials.wrong += work.wrong_pixels(out, tolerance=0)
                continue
            trials.count += 1
            trials.ending.append((ended.seconds[0] - before[0], ended.seconds[1] - before[1]))
            if ended.status != 2 or ended.said.count("\n") != 1 or "--resume" not in ended.said:
                trials.broken.append(f"status {ended.status}: {ended.said}")
            recover(work, trials, out, max(finished, running.finished))
    return trials


def _wait_for_workers(cluster: LocalCluster) -> None:
    """In a process that is gone then, and with it distributed's threads."""
    waiting = multiprocessing.get_context("fork").Process(target=cluster.wait_for_workers, args=(2,))
    waiting.start()
    waiting.join()
    if waiting.exitcode:
        raise TimeoutError("the workers did not come up")


def _wait_for_passes(running: Running, passes: float) -> None:
    while running.finished < passes and running.runs():
        time.sleep(LOOK_EVERY)


def _watched(running: Running, passes: int) -> tuple[Ended, float]:
    """How the command ended, and the longest time in seconds until then without a new pass."""
    last, finished, longest = time.monotonic(), running.finished, 0.0
    while finished < passes and running.runs():
        time.sleep(LOOK_EVERY)
        now = time.monotonic()
        longest = max(longest, now - last)
        if running.finished > finished:
            last, finished = now, running.finished
    return running.end(), longest
