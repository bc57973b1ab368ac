"""Take the picture of the report that the README shows: `python docs/screenshot.py [REPORT.html [PICTURE.png]]`.

Needs Chromium and its driver on the path. The window shows the top of the page in the light colour scheme.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WIDTH, HEIGHT = 1280, 900


def take(report: Path, picture: Path) -> None:
    """Write the top of `report` as it looks in a window of the size above to `picture`."""
    from selenium import webdriver

    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        sys.exit("Chromium or its driver is missing; install both (Debian: chromium chromium-driver)")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"):
        options.add_argument(argument)
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    try:
        size = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        scheme = [{"name": "prefers-color-scheme", "value": "light"}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": scheme})
        browser.get(report.resolve().as_uri())
        browser.save_screenshot(str(picture))
    finally:
        browser.quit()


def main() -> None:
    """Read the two paths and take the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("report", nargs="?", type=Path, default=ROOT / "report" / "index.html")
    parser.add_argument("picture", nargs="?", type=Path, default=ROOT / "docs" / "report.png")
    arguments = parser.parse_args()
    if not arguments.report.is_file():
        sys.exit(f"{arguments.report} does not exist; make it with `make report`")
    take(arguments.report, arguments.picture)
    print(arguments.picture)


if __name__ == "__main__":
    main()
