"""The report in headless Chromium: no request beyond the file, 1280 px wide, and as a PDF.

    python tests/campaigns/validation_page.py validation/report.html --pdf report.pdf

Prints the width that the page needs, the requests that it made, and the pages of the PDF;
exit code 1 if it needs more than 1280 px, asks for anything, or prints nothing.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

CHROMIUM = ["chromium", "--headless", "--no-sandbox", "--disable-gpu",
            "--disable-background-networking", "--disable-component-update",
            "--disable-default-apps", "--disable-sync", "--no-first-run"]  # fmt: skip
WIDTH = 1280
ASK = "<script>document.title = 'width ' + document.documentElement.scrollWidth</script>"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("page", type=Path)
    parser.add_argument("--pdf", type=Path, default=None)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        asking = folder / "asking.html"
        text = options.page.read_text("utf-8")
        asking.write_text(text.replace("</body>", ASK + "</body>"), "utf-8")
        log = folder / "net.json"
        dom = chromium(f"--window-size={WIDTH},900", f"--log-net-log={log}", "--dump-dom",
                       asking.as_uri())  # fmt: skip
        width = int(re.search(r"<title>width (\d+)</title>", dom)[1])
        urls = sorted(requests(log))
        pdf = folder / "report.pdf"
        chromium("--no-pdf-header-footer", f"--print-to-pdf={pdf}", options.page.resolve().as_uri())
        content = pdf.read_bytes()
        pages = len(re.findall(rb"/Type\s*/Page\b", content))
        if options.pdf:
            shutil.copyfile(pdf, options.pdf)
    print(f"needs {width} px of {WIDTH}")
    print(f"requests beyond the file: {urls or 'none'}")
    print(f"PDF: {pages} pages, {len(content) / 1000:.0f} kB")
    return 0 if width <= WIDTH and not urls and pages else 1


def chromium(*arguments: str) -> str:
    done = subprocess.run([*CHROMIUM, *arguments], capture_output=True, text=True, check=True)
    return done.stdout


def requests(log: Path) -> set[str]:
    """Return what was asked of the network, but for the browser's own services."""
    events = json.loads(log.read_text("utf-8"))["events"]
    urls = {str(event.get("params", {}).get("url", "")) for event in events}
    own = re.compile(r"https?://([^/]*\.)?(google|gstatic|googleapis)\.com|^chrome")
    return {url for url in urls if url.startswith("http") and not own.search(url)}


if __name__ == "__main__":
    sys.exit(main())
