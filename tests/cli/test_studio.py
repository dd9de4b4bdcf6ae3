"""`flexcal studio` as a process: what it says, and how it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

import pytest
from browser import studio
from refusals import assert_refusal
from waiting import PATIENCE, until

from flexcal.cli.main import main


def test_ctrl_c_ends_it(tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    with studio(tmp_path, "--json") as running:
        assert running.url.startswith("http://127.0.0.1:") and running.url.endswith("/")
        said = running.stop(signal.SIGINT)
    assert running.process.exitcode == 0 and json.loads(said) == {"folder": str(tmp_path)}


def test_a_word_of_warning_where_others_are_let_in(tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    for host, warned in (("0.0.0.0", True), ("localhost", False)):
        with studio(tmp_path, "--host", host) as running:
            running.stop(signal.SIGTERM)
        assert ("nothing is encrypted" in " ".join(running.said)) == warned


def test_what_cannot_be_opened(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["studio", str(tmp_path / "absent")]) == 2
    assert_refusal(capsys.readouterr().err, "E-STUDIO-040", str(tmp_path / "absent"))
    for arguments, code, name in (
        (["--host", "192.0.2.77"], "E-STUDIO-003", "192.0.2.77"),
        (["--host", "no.such.name.invalid"], "E-STUDIO-003", "no.such.name.invalid"),
        (["--port", "70000"], "E-STUDIO-004", "70000"),
    ):
        assert main(["studio", str(tmp_path), *arguments]) == 2
        assert_refusal(capsys.readouterr().err, code, name)


def test_without_viser(tmp_path: Path) -> None:
    (tmp_path / "viser.py").write_text("raise ModuleNotFoundError(\"No module named 'viser'\", name='viser')")
    command = [sys.executable, "-m", "flexcal.cli.main", "studio", str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    ended = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=PATIENCE)
    assert ended.returncode == 2
    assert_refusal(ended.stderr, "E-STUDIO-001")
    assert "pip install 'flexcal[studio]'" in ended.stderr


def test_browser_is_not_given_the_token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The program that `BROWSER` names is started with a file that its owner alone can read, and that leads to the window."""
    pytest.importorskip("viser", reason="viser is absent: pip install 'flexcal[studio]'")
    browser = tmp_path / "browser.sh"
    browser.write_text(
        f'#!/bin/sh\necho "$1" > "{tmp_path}/seen.part" && mv "{tmp_path}/seen.part" "{tmp_path}/seen"\n'
    )
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", str(browser))
    monkeypatch.setenv("DISPLAY", ":0")
    with studio(tmp_path, browser=True) as running:
        until((tmp_path / "seen").exists)
        seen = (tmp_path / "seen").read_text().strip()
        page = Path(url2pathname(urlsplit(seen).path))
        assert urlsplit(running.url).path.strip("/") not in seen
        assert page.stat().st_mode & 0o077 == page.parent.stat().st_mode & 0o077 == 0
        assert f'content="0; url={running.url}"' in page.read_text()
        running.stop(signal.SIGINT)
    assert not page.parent.exists()
