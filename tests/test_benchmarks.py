"""What `make bench` does where a peer cannot be had, and with a name it does not know."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import peers
from benchmarks.__main__ import main


def test_a_peer_that_cannot_be_installed_is_skipped_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(peers, "ENVIRONMENTS", tmp_path)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_DISABLE_PIP_VERSION_CHECK", "1")
    assert main(["geometric_fit"]) == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("geometric_fit")]
    assert (
        "skipped: pybotics==3.1.2" in line
        and "cannot be installed" in line
        and "No matching distribution" in line
    )


def test_an_unknown_name_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["geometric"]) == 2
    assert "there are accuracy_map, actuators, compensation, dynamics, estimators" in capsys.readouterr().err
