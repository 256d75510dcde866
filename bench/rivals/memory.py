"""Device memory in use, as NVIDIA's driver counts it."""

import shutil
import subprocess
import threading
from collections.abc import Callable
from typing import Any


class DeviceMemory:
    """Of the first GPU, some fifty times a second. Nothing else may run there."""

    def __init__(self) -> None:
        self.last = self.peak = 0
        self.fresh = threading.Condition()
        command = ["nvidia-smi", "--id=0", "--query-gpu=memory.used", "--format=csv,noheader,nounits", "--loop-ms=20"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        threading.Thread(target=self.read, daemon=True).start()

    @staticmethod
    def is_there() -> bool:
        return shutil.which("nvidia-smi") is not None

    def read(self) -> None:
        for line in self.process.stdout:
            with self.fresh:
                self.last = int(line) << 20
                self.peak = max(self.peak, self.last)
                self.fresh.notify_all()

    def during(self, work: Callable[[], Any]) -> tuple[Any, int]:
        """What the work returns, and the most bytes in use meanwhile."""
        with self.fresh:
            self.peak = 0
        done = work()
        with self.fresh:
            self.fresh.wait(1)  # for a sample, however short the work was
            return done, self.peak

    def now(self) -> int:
        return self.during(lambda: None)[1]

    def close(self) -> None:
        self.process.terminate()
        self.process.wait()
