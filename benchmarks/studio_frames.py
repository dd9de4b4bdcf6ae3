"""Frames per second of the studio's scene without a graphics card: a UR5 and 1000 residual arrows at 1280 × 720 (limits: 20, and 1 GB).

Headless Chromium draws by SwiftShader. A frame counts when it was drawn, one pixel of it read back; viser draws only where something has
changed, so the camera is turned with the mouse, or the exaggeration changed 25 times a second. Beside the arrows of the studio, merged
meshes, stand other ways to draw them. Processor time per frame is that of all processes of the browser.
"""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks._chromium import Tab, chromium, require_chromium, require_viser
from flexcal.model.kinematics import point_kinematics
from flexcal.model.robot import RobotModel

ARROWS = 1000
FRAMES, MEGABYTES = 20.0, 1000.0
SECONDS = 8.0
_WIDTH = 0.01
_COUNTER = """
window.frames_drawn = 0;
(() => {
  let context = null;
  const pixel = new Uint8Array(4);
  for (const name of ['drawElements', 'drawArrays', 'drawElementsInstanced', 'drawArraysInstanced']) {
    const draw = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...values) { context = this; return draw.apply(this, values); };
  }
  const tick = () => {
    if (context !== null) {
      context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, pixel);
      window.frames_drawn += 1; context = null;
    }
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
})();
"""

Stretch = Callable[[float], None]
"""Draws the arrows with an exaggeration relative to the first."""


def run() -> list[tuple[str, float, str]]:
    """Frames per second over the limit, and the limit of memory over what the server takes."""
    require_chromium()
    require_viser()
    model = RobotModel.from_yaml(
        Path(__file__).parent.parent / "examples" / "ur5_tracker" / "robot.yaml", estimates=False
    )
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (ARROWS, model.n))
    starts = point_kinematics(model, q, jacobians=False).position
    vectors = 0.03 * np.random.default_rng(1).normal(size=starts.shape)
    rows = []
    for label, draw in _WAYS.items():
        measured = _measured(model, q[0], lambda scene, draw=draw: draw(scene, starts, vectors))
        for motion, (frames, busy, memory) in measured.items():
            note = f"{frames:.1f} frames/s, {1e3 * busy:.0f} ms of processor time each, largest process of the browser {memory:.0f} MB"
            rows.append((f"{label}: {motion}, limit {FRAMES:g} frames/s", frames / FRAMES, note))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    rows.append((f"memory of the server, limit {MEGABYTES:g} MB", MEGABYTES / peak, f"{peak:.0f} MB"))
    return rows


def _measured(
    model: RobotModel, q: np.ndarray, draw: Callable[..., Stretch]
) -> dict[str, tuple[float, float, float]]:
    """Frames per second, processor seconds a frame and megabytes, by what moves."""
    import viser

    from flexcal.studio.scene import RobotView, Surroundings

    with chromium("--use-gl=angle", "--use-angle=swiftshader") as tab:
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        Surroundings(server.scene).frame(server.initial_camera, model.reach)
        RobotView(server.scene, model).pose(q)
        stretch = draw(server.scene)
        tab.ask(
            "Emulation.setDeviceMetricsOverride", width=1280, height=720, deviceScaleFactor=1, mobile=False
        )
        tab.ask("Page.addScriptToEvaluateOnNewDocument", source=_COUNTER)
        tab.ask("Page.navigate", url=f"http://127.0.0.1:{server.get_port()}")
        time.sleep(6.0)
        _mouse(tab, "mousePressed", 0.0)
        turning = _counted(tab, lambda passed: _mouse(tab, "mouseMoved", passed))
        _mouse(tab, "mouseReleased", SECONDS)

        def stretched(passed: float) -> None:
            stretch(1.0 + 0.5 * np.sin(passed))
            time.sleep(0.04)

        exaggerating = _counted(tab, stretched)
        server.stop()
    return {"camera": turning, "exaggeration": exaggerating}


def _counted(tab: Tab, move: Callable[[float], None]) -> tuple[float, float, float]:
    first, busy = tab.value("window.frames_drawn"), _processor_time()
    begun = time.perf_counter()
    while (passed := time.perf_counter() - begun) < SECONDS:
        move(passed)
    frames = tab.value("window.frames_drawn") - first
    passed = time.perf_counter() - begun
    return frames / passed, (_processor_time() - busy) / max(frames, 1), _largest_process()


def _mouse(tab: Tab, kind: str, passed: float) -> None:
    tab.ask(
        "Input.dispatchMouseEvent", type=kind, button="left", buttons=0 if kind == "mouseReleased" else 1, clickCount=1,
        x=400 + 200 * float(np.sin(2 * passed)), y=420 + 30 * float(np.cos(2 * passed)),
    )  # fmt: skip


def _below(process: int) -> Iterator[int]:
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        for child in map(int, task.read_text().split()):
            yield child
            yield from _below(child)


def _processor_time() -> float:
    """Seconds that the processes below this one have computed."""
    fields = [
        Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split() for child in _below(os.getpid())
    ]
    return sum(int(field[11]) + int(field[12]) for field in fields) / os.sysconf("SC_CLK_TCK")


def _largest_process() -> float:
    pages = [int(Path(f"/proc/{child}/statm").read_text().split()[1]) for child in _below(os.getpid())]
    return max(pages) * os.sysconf("SC_PAGE_SIZE") / 1e6


def _merged(scene, starts: np.ndarray, vectors: np.ndarray) -> Stretch:
    from flexcal.studio.scene import ResidualArrows

    arrows = ResidualArrows(scene, starts, vectors, name="/arrows", width=_WIDTH)
    return lambda factor: setattr(arrows, "exaggeration", factor)


def _nothing(scene, starts: np.ndarray, vectors: np.ndarray) -> Stretch:
    ball = scene.add_icosphere("/arrows", radius=0.01)
    return lambda factor: setattr(ball, "position", (0.0, 0.0, factor))


def _segments(scene, starts: np.ndarray, vectors: np.ndarray) -> Stretch:
    def points(factor: float) -> np.ndarray:
        return np.stack([starts, starts + factor * vectors], axis=1).astype(np.float32)

    lines = scene.add_line_segments(
        "/arrows", points(1.0), (31, 111, 208), thickness=2.0, thickness_units="screen"
    )
    return lambda factor: setattr(lines, "points", points(factor))


def _viser_arrows(scene, starts: np.ndarray, vectors: np.ndarray) -> Stretch:
    def points(factor: float) -> np.ndarray:
        return np.stack([starts, starts + factor * vectors], axis=1).astype(np.float32)

    arrows = scene.add_arrows(
        "/arrows", points(1.0), (31, 111, 208), shaft_radius=0.0015, head_radius=0.004, head_length=0.012
    )
    return lambda factor: setattr(arrows, "points", points(factor))


def _batched(scene, starts: np.ndarray, vectors: np.ndarray) -> Stretch:
    """Instances of a pyramid of four sides, turned and stretched."""
    from scipy.spatial.transform import Rotation

    from flexcal.studio.scene.rotations import across

    length = np.linalg.norm(vectors, axis=1)
    x, y = across(vectors)
    turns = Rotation.from_matrix(np.stack([x, y, vectors / length[:, None]], axis=2)).as_quat()
    corners = np.array([[0.5, 0, 0], [0, 0.5, 0], [-0.5, 0, 0], [0, -0.5, 0], [0, 0, 1]])
    faces = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])

    def scales(factor: float) -> np.ndarray:
        return np.column_stack([np.full((ARROWS, 2), _WIDTH), factor * length]).astype(np.float32)

    bodies = scene.add_batched_meshes_simple(
        "/arrows", corners, faces, np.roll(turns, 1, axis=1), starts, batched_scales=scales(1.0), lod="off",
        flat_shading=True, cast_shadow=False, receive_shadow=False,
    )  # fmt: skip
    return lambda factor: setattr(bodies, "batched_scales", scales(factor))


_WAYS: dict[str, Callable[..., Stretch]] = {
    "as the studio draws them": _merged,
    "no arrows": _nothing,
    "line segments": _segments,
    "batched pyramids": _batched,
    "viser's arrows": _viser_arrows,
}
