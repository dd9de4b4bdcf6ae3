"""Pictures of docs/stage-1-on-your-own-robot.md: the experiment with the two-axis robot of the tests, through the commands of the page.

    python docs/stage1_pictures.py [FOLDER]

works in a temporary folder, or in FOLDER, and writes three drawings to docs/_static/stage1. It takes a minute.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests" / "jobs")]

from played_robot import ROBOT, URDF, Robot  # noqa: E402

from flexcal import FrequencyResponse, MultisinePlan, RobotModel, played_signals, read_plan  # noqa: E402
from flexcal.cli.main import main  # noqa: E402
from flexcal.data.recordings import read_recording  # noqa: E402
from flexcal.model.vibration import linearise, transfer_matrix  # noqa: E402

OUT = ROOT / "docs" / "_static" / "stage1"
WIDTH, HEIGHT, LEFT, RIGHT, BOTTOM = 760, 190, 70, 30, 30
MOST = 700
"""Stretches of a line; of each that has more samples the least and the largest is drawn."""
BLUE, ORANGE, GREY, TEXT = "#2f6db3", "#d9761c", "#8a8f98", "#6b7280"
POSES = "plan,pose,q1_deg,q2_deg\ndefault,1,-17,29\ndefault,2,-57,92\n"


class Panel:
    """A diagram in SVG: its range, and what is drawn into it."""

    def __init__(self, x: tuple[float, float], y: tuple[float, float], label: str, *, log: bool = False):
        self.x, self.y, self.label, self.log = x, y, label, log
        self.parts: list[str] = []

    def place(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        low, high = (np.log10(side) if self.log else side for side in self.y)
        y = np.log10(y) if self.log else y
        across = LEFT + (np.asarray(x) - self.x[0]) / (self.x[1] - self.x[0]) * (WIDTH - LEFT - RIGHT)
        return np.column_stack([across, 10 + (high - y) / (high - low) * (HEIGHT - BOTTOM - 10)])

    def line(self, x: np.ndarray, y: np.ndarray, colour: str, width: float = 1.2) -> Panel:
        if len(x) > 4 * MOST:
            stretches = [np.sort(values)[[0, -1]] for values in np.array_split(y, MOST)]
            x = np.linspace(x[0], x[-1], 2 * MOST)
            y = np.concatenate(stretches)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in self.place(x, y))
        self.parts.append(
            f'<polyline fill="none" stroke="{colour}" stroke-width="{width}" points="{points}"/>'
        )
        return self

    def dots(self, x: np.ndarray, y: np.ndarray, colour: str) -> Panel:
        self.parts += [
            f'<circle cx="{a:.1f}" cy="{b:.1f}" r="1.8" fill="{colour}"/>' for a, b in self.place(x, y)
        ]
        return self

    def band(self, low: float, high: float, text: str, opacity: float) -> Panel:
        (a, top), (b, _) = self.place(np.array([low, high]), np.array([self.y[1]] * 2))
        height = HEIGHT - BOTTOM - 10
        self.parts.insert(
            0,
            f'<rect x="{a:.1f}" y="{top:.1f}" width="{b - a:.1f}" height="{height}" fill="{GREY}" opacity="{opacity}"/>',
        )
        self.parts.append(
            f'<text x="{(a + b) / 2:.1f}" y="22" text-anchor="middle" fill="{TEXT}">{text}</text>'
        )
        return self

    def svg(self, top: int, ticks: Sequence[float], unit: str) -> str:
        base = HEIGHT - BOTTOM
        marks = "".join(
            f'<text x="{a:.1f}" y="{base + 16}" text-anchor="middle" fill="{TEXT}">{tick:g} {unit}</text>'
            for tick, (a, _) in zip(
                ticks, self.place(np.array(ticks), np.full(len(ticks), self.y[0])), strict=True
            )
        )
        sides = "".join(
            f'<text x="{LEFT - 6}" y="{y}" text-anchor="end" fill="{TEXT}">{value:g}</text>'
            for y, value in ((16, self.y[1]), (base, self.y[0]))
        )
        turn = f'transform="rotate(-90 12 {base // 2})" text-anchor="middle"'
        label = f'<text x="12" y="{base // 2}" fill="{TEXT}" {turn}>{self.label}</text>'
        frame = f'<rect x="{LEFT}" y="10" width="{WIDTH - LEFT - RIGHT}" height="{base - 10}" fill="none" stroke="{GREY}" opacity="0.6"/>'
        return f'<g transform="translate(0 {top})">{"".join(self.parts)}{frame}{marks}{sides}{label}</g>'


def write(name: str, panels: Sequence[Panel], ticks: Sequence[float], unit: str) -> None:
    drawn = "".join(panel.svg(number * HEIGHT, ticks, unit) for number, panel in enumerate(panels))
    size = f'viewBox="0 0 {WIDTH} {HEIGHT * len(panels)}" font-family="sans-serif" font-size="12"'
    OUT.mkdir(exist_ok=True)
    (OUT / name).write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{drawn}</svg>\n', encoding="utf-8"
    )


def run(*words: object) -> None:
    if main([str(word) for word in words]):
        raise SystemExit(f"failed: {' '.join(map(str, words))}")


def experiment(folder: Path) -> None:
    """The commands of the page, and the robot between them."""
    (folder / "fence.urdf").write_text(URDF)
    (folder / "robot.yaml").write_text(ROBOT)
    (folder / "frequency_poses.csv").write_text(POSES)
    robot = folder / "robot.yaml"
    run("design", "frequency", robot, "--out", folder / "frequency.yaml")
    run("export", "excitation", folder / "frequency.yaml", "--out", folder / "excitation", "--rate", 1000)
    Robot().play(folder / "excitation", before=1.0).write(folder / "recordings", by_hand=5)
    measured = ("--cell", folder / "recordings", "--out", folder / "frequency")
    run("measure", folder / "excitation" / "plan.yaml", "--robot", robot, *measured)
    run("identify", "response", robot, folder / "frequency", "--out", folder / "responses")
    run("identify", "stiffness", robot, folder / "responses")


def draw(folder: Path) -> None:
    plan = read_plan(folder / "excitation" / "plan.yaml")
    assert isinstance(plan, MultisinePlan)
    signal = next(played_signals(plan))
    period, end = 1 / plan.base_frequency_hz, signal.time[-1]
    limits = (0.0, end)
    moved = np.degrees(signal.position[:, 0] - plan.poses[0, 0])
    panels = [
        Panel(limits, (-2, 2), "reference of j1 / deg").line(signal.time, moved, BLUE),
        Panel(limits, (-60, 60), "added torque of j1 / N m").line(
            signal.time, signal.torque[:, 0], ORANGE, 0.6
        ),
    ]
    for panel in panels:
        panel.band(1, signal.start, "settling", 0.12)
        panel.band(
            signal.start,
            end - 1,
            f"measured: {plan.periods - plan.settle_periods} periods of {period:g} s",
            0.28,
        )
    write("signal.svg", panels, [0, 1, signal.start, round(end - 1), round(end)], "s")

    model = RobotModel.from_yaml(folder / "robot.yaml")
    name = "pose_1_realisation_1_experiment_1_plus"
    raw = read_recording(folder / "recordings" / f"{name}.csv", model)
    found = read_recording(folder / "frequency" / f"{name}.parquet", model)
    tau = raw.torque[:, 0] - raw.torque[:, 0].mean()
    begin = (
        int(np.argmin([np.abs(raw.q[k : k + 500] - found.q[:500]).max() for k in range(4000)]))
        * raw.time_step
    )
    window = (begin - 1.1, begin + 0.9)
    kept = (raw.time - raw.start > window[0]) & (raw.time - raw.start < window[1])
    later = signal.time - 1 + begin
    shown = (later > window[0]) & (later < window[1])
    panel = Panel(window, (-50, 50), "torque of j1 / N m")
    panel.line(raw.time[kept] - raw.start, tau[kept], GREY, 0.8)
    panel.line(later[shown], signal.torque[shown, 0], ORANGE, 0.8)
    panel.band(begin, window[1], "the plan's periods, as found", 0.15)
    write("found.svg", [panel], [round(window[0], 1), round(begin, 2), round(window[1], 1)], "s")

    panels = []
    for pose in (1, 2):
        response = FrequencyResponse.load(folder / "responses" / f"response_pose_{pose}.npz")
        lines = np.linspace(response.frequencies_hz[0], response.frequencies_hz[-1], 800)
        fitted = transfer_matrix(linearise(model, response.q_mean), lines).response
        panel = Panel((0, 80), (0.02, 20), f"pose {pose}: |G| / (kg m²)⁻¹", log=True)
        for axis, colour in ((0, BLUE), (1, ORANGE)):
            panel.line(lines, np.abs(fitted[:, axis, axis]), colour)
            panel.dots(response.frequencies_hz, np.abs(response.response[:, axis, axis]), colour)
        panels.append(panel)
    write("response.svg", panels, [0, 20, 40, 60, 80], "Hz")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        place = Path(sys.argv[1])
        place.mkdir(exist_ok=True)
        if not (place / "responses").exists():
            experiment(place)
        draw(place)
    else:
        with tempfile.TemporaryDirectory() as temporary:
            experiment(Path(temporary))
            draw(Path(temporary))
