"""A real Dask scheduler on loopback, and the workers that are started."""

import os
import signal
import socket
import subprocess
import sys
import time

from tests.commandline import ROOT


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Cluster:
    """Killed at the end, whatever happened."""

    def __init__(self, folder):
        self.folder, self.workers = folder, []
        port = free_port()
        self.address = f"tcp://127.0.0.1:{port}"
        self.scheduler = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")

    def work(self, count=1, **environment):
        words = ("dask_worker", self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        self.workers += [self._start(*words, **environment) for _ in range(count)]

    def wait(self, workers=0):
        from distributed import Client

        with Client(self.address, timeout=30, set_as_default=False) as client:
            if workers:
                client.wait_for_workers(workers, timeout=60)

    def kill(self):
        for each in (self.scheduler, *self.workers):
            if each.poll() is None:
                os.killpg(each.pid, signal.SIGKILL)
            each.wait()

    def _start(self, *words, **environment):
        command = [sys.executable, "-m", "distributed.cli." + words[0], *words[1:]]
        with open(self.folder / f"{words[0]}-{time.monotonic_ns()}.log", "wb") as log:
            return subprocess.Popen(
                command, env={**os.environ, "PYTHONPATH": str(ROOT), **environment}, cwd=self.folder, stdout=log, stderr=log,
                start_new_session=True,
            )  # fmt: skip
