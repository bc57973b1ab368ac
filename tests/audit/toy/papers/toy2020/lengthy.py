"""An experiment that takes as long as it is told."""

import time


def wait(seconds: float, label: str) -> dict[str, str]:
    time.sleep(seconds)
    return {"waited": label}
