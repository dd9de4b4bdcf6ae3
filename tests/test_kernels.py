"""The builds of the kernels for different processors, and the triangle that rows are brought into."""

import numpy as np
import pytest

from flexcal import _kernels
from flexcal.kernels import update
from flexcal.model.robot import RobotModel
from flexcal.model.statics import static_equilibrium


@pytest.mark.skipif(not _kernels.avx2, reason="this processor runs only one of the builds")
def test_builds_agree_bit_by_bit(tx90l: RobotModel, rng: np.random.Generator) -> None:
    """On what this processor makes of the same numbers, by every kernel in lanes: else results would depend on the machine."""
    from flexcal import _kernels_avx2

    arm = tx90l.joints
    links = (
        [j.parent for j in arm],
        [j.kind == "prismatic" for j in arm],
        np.array([j.rotation for j in arm]),
        np.array([j.translation for j in arm]),
        np.array([j.normals for j in arm]),
        np.array([np.eye(3)] * len(arm)),
    )
    states = rng.normal(size=(3, 101, 6))
    geometry = 1e-3 * rng.normal(size=(6, 6))
    scatter = [rng.normal(size=shape) for shape in ((7, 4, 4, 3, 2), (7, 3, 3, 2), (7, 4, 4, 2))]
    found = []
    for build in (_kernels, _kernels_avx2):
        out = np.zeros((360, 101))
        places = np.arange(360).reshape(6, 60)
        tree = build.Tree.build(*links)
        tree.torque_regressor(geometry, tx90l.gravity, *states, places, out)
        adjoint = tree.torque_regressor_adjoint(geometry, tx90l.gravity, *states, places, out)
        factor = np.zeros((60, 60))
        build.update(factor, out[:60].copy())
        covariance = np.zeros((7, 12, 12, 2))
        build.scatter_covariance(*scatter, 3, 9.0, covariance)
        found.append((out, adjoint, factor, covariance))
    for ours, theirs in zip(*found, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert np.abs(found[0][0]).max() > 1.0


def test_a_pose_at_rest_does_not_depend_on_those_beside_it(
    tx90l: RobotModel, rng: np.random.Generator
) -> None:
    """Seven poses, four at a time, against one by one; and derivatives by offsets against those by all parameters."""
    q, payload = rng.uniform(-1.5, 1.5, (7, 6)), rng.uniform(0.0, 6.0, 7)
    together = static_equilibrium(tx90l, q, payload, sensitivities=True)
    alone = [static_equilibrium(tx90l, q[[k]], payload[[k]], sensitivities=True) for k in range(7)]
    for name in ("deflection", "torque", "compliance", "by_offset", "regressor", "coupling"):
        expected = np.concatenate([getattr(one, name) for one in alone])
        np.testing.assert_array_equal(getattr(together, name), expected)
    assert np.abs(together.deflection).max() > 1e-4
    command = static_equilibrium(tx90l, q, payload, sensitivities=True, parameters=False)
    np.testing.assert_array_equal(command.by_offset, together.coupling[:, :, ::6])
    np.testing.assert_array_equal(command.compliance, together.compliance)
    assert not len(command.coupling) and not len(command.regressor)


@pytest.mark.parametrize("width", [1, 2, 4, 17, 18])
@pytest.mark.parametrize("rows", [1, 3, 39, 256, 1001])
def test_the_triangle_is_that_of_numpy(rows: int, width: int, rng: np.random.Generator) -> None:
    """Up to signs, which also R of numpy has no rule for; rows come in two parts, and one column is zero."""
    columns = rng.normal(size=(width, 2 * rows))
    columns[5:6] = 0.0
    factor = np.zeros((width, width))
    for part in (columns[:, :rows], columns[:, rows:]):
        update(factor, part)
    assert (np.tril(factor, -1) == 0).all()
    np.testing.assert_allclose(factor.T @ factor, columns @ columns.T, rtol=0, atol=1e-12 * 2 * rows)
    whole = min(5, width)
    if 2 * rows >= width:
        expected = np.linalg.qr(columns[:whole].T, mode="r")
        np.testing.assert_allclose(
            np.abs(factor[:whole, :whole]), np.abs(expected), rtol=0, atol=1e-12 * rows
        )


def test_columns_that_nearly_depend_on_each_other_keep_their_digits(rng: np.random.Generator) -> None:
    """R has columns apart by 1e-9 of their size to its own rounding, of which products of columns tell nothing."""
    common = rng.normal(size=(1, 700))
    columns = common + 1e-9 * rng.normal(size=(9, 700))
    factor = np.zeros((9, 9))
    update(factor, columns)
    expected = np.abs(np.diag(np.linalg.qr(columns.T, mode="r")))
    np.testing.assert_allclose(np.abs(np.diag(factor)), expected, rtol=1e-5)
    assert expected[-1] < 1e-7 * expected[0]


def test_rows_are_read_as_any_array_has_them(rng: np.random.Generator) -> None:
    columns = rng.normal(size=(6, 300))
    expected = np.zeros((6, 6))
    update(expected, columns)
    for array in (
        np.asfortranarray(columns),
        np.repeat(columns, 2, axis=1)[:, ::2],
        np.pad(columns, ((0, 0), (3, 4)))[:, 3:-4],
    ):
        found = np.zeros((6, 6))
        update(found, array)
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("largest", [1e-3, 4.0, 300.0, 9.9e4, 1e9])
def test_cosine_and_sine_are_exact_to_rounding(largest: float, rng: np.random.Generator) -> None:
    """A pendulum's torque regressor has gravity times both; angles about multiples of π/2, too, in extended precision."""
    angles = rng.uniform(-largest, largest, 4001)
    angles[::2] = np.round(angles[::2] / (np.pi / 2)) * (np.pi / 2)
    still = np.zeros((len(angles), 1))
    one = np.eye(3)[None]
    normals = np.eye(3)[None, :2]
    tree = _kernels.Tree.build([-1], [False], one, np.zeros((1, 3)), normals, one)
    out = np.zeros((10, len(angles)))
    places, gravity = np.arange(10)[None], np.array([0.0, 1.0, 0.0])
    tree.torque_regressor(np.zeros((1, 6)), gravity, angles[:, None], still, still, places, out)
    precise = angles.astype(np.longdouble)
    np.testing.assert_allclose(out[1], -np.cos(precise).astype(float), rtol=0, atol=2.3e-16)
    np.testing.assert_allclose(out[2], np.sin(precise).astype(float), rtol=0, atol=2.3e-16)


_SHAPES = {
    "placement": (3, 3),
    "translation": (3,),
    "target": (3,),
    "geometry": (6, 6),
    "tool": (6,),
    "q": (4, 6),
    "deflection": (4, 6, 3),
    "stiffness": (2,),
    "mass": (6,),
    "first_moment": (6, 3),
    "payload": (4,),
    "payload_point": (3,),
    "gravity": (3,),
    "dq": (4, 6),
    "ddq": (4, 6),
    "places": (6, 60),
    "out": (5, 4),
    "weights": (5, 4),
    "placements": (3, 3, 3),
    "translations": (3, 3),
    "normals": (3, 2, 3),
    "bearings": (3, 3, 3),
    "triangle": (3, 3),
    "rows": (3, 10),
    "position": (4,),
    "velocity": (4,),
    "force": (4,),
    "springs": (4, 6),
    "frictions": (2, 5),
    "motors": (2,),
    "twists": (2,),
    "proportional": (2,),
    "derivative": (2,),
    "feed_forward": (7, 2),
    "reference": (7, 2),
    "reference_rate": (7, 2),
    "position_log": (7, 2),
    "torque_log": (7, 2),
    "arm_log": (7, 2),
    "angle": (4,),
    "applied": (4,),
    "hinges": (4, 6),
    "errors": (2, 9),
    "gains": (2, 3),
    "torque": (7, 2),
    "angle_log": (7, 2),
    "white": (5, 3, 4, 2, 2),
    "right": (5, 2, 2, 2),
    "left": (5, 3, 3, 2),
    "covariance": (5, 6, 6, 2),
    "lower": (3, 3),
    "inverse": (3, 3),
    "to": (4,),
    "source": (4,),
    "values": (5, 2),
    "sums": (6, 2),
}
_INDICES = {"places", "motors", "twists", "to", "source"}
_WRITTEN = {
    "out",
    "triangle",
    "position",
    "velocity",
    "force",
    "position_log",
    "torque_log",
    "arm_log",
}
_WRITTEN |= {"angle", "applied", "angle_log", "covariance", "inverse", "sums"}
_POINT = ("placement", "translation", "target", "geometry", "tool", "q", "deflection")
_REST = ("stiffness", "geometry", "mass", "first_moment", "payload", "payload_point", "gravity", "q")
_MOTION = ("geometry", "gravity", "q", "dq", "ddq", "places")
_LOOP = (
    "position",
    "velocity",
    "force",
    "springs",
    "frictions",
    "motors",
    "twists",
    "proportional",
    "derivative",
)
_SIGNALS = ("feed_forward", "reference", "reference_rate", "position_log", "torque_log", "arm_log")
_GEARED = (
    "angle",
    "velocity",
    "applied",
    "hinges",
    "motors",
    "twists",
    "frictions",
    "errors",
    "gains",
    "torque",
)
_PLANT = {"step": 1, "model": 1, "data": 1, "tick": 1e-3, "substeps": 1}
_KERNELS = [
    ("point", _POINT, {"joint": 5, "jacobians": True}),
    ("equilibrium", _REST, {"axes": [(0, 2), (1, 2)], "payload_joint": 5, "sensitivities": True}),
    ("torque_regressor", (*_MOTION, "out"), {}),
    ("torque_regressor_adjoint", (*_MOTION, "weights"), {}),
    ("build", ("placements", "translations", "normals", "bearings"), {"parents": [-1, 0, 1], "prismatic": [False] * 3}),
    ("update", ("triangle", "rows"), {}),
    ("scatter_covariance", ("white", "right", "left", "covariance"), {"window": 3, "freedom": 9.0}),
    ("triangular_inverse", ("lower", "inverse"), {}),
    ("add_selected", ("to", "source", "values", "sums"), {}),
    ("closed_loop", (*_LOOP, *_SIGNALS), {**_PLANT, "encoder_resolution": 0.0, "rate_filter": 1.0}),
    ("geared_loop", (*_GEARED, *_SIGNALS[1:3], "angle_log", "torque_log"), {**_PLANT, "count": 0.0, "filter": 1.0}),
]  # fmt: skip
_EVERY = [(kernel, name) for kernel, arrays, _ in _KERNELS for name in arrays]


def _called(tree, kernel: str, changed: dict[str, object]) -> object:
    """Call a kernel with arrays of the shapes that it takes, except for those `changed`."""
    _, names, others = next(entry for entry in _KERNELS if entry[0] == kernel)
    arrays: dict[str, object] = {
        name: np.full(_SHAPES[name], -1) if name in _INDICES else np.zeros(_SHAPES[name]) for name in names
    }
    if "frictions" in names and "hinges" in names:
        arrays["frictions"] = np.zeros((2, 7))
    if "stiffness" in names:
        arrays["stiffness"] = np.full(2, 1e9)
    owner = tree if hasattr(tree, kernel) else _kernels
    return getattr(owner, kernel)(**others, **(arrays | changed))


@pytest.mark.parametrize("size", [0, 1, 2, 5, 64, 151])
def test_the_inverse_of_a_triangle_is_that_of_numpy(size: int, rng: np.random.Generator) -> None:
    lower = np.tril(rng.standard_normal((size, size))) + 3 * np.sqrt(size) * np.eye(size)
    inverse = np.full((size, size), np.nan)
    _kernels.triangular_inverse(lower + np.triu(rng.standard_normal((size, size)), 1), inverse)
    np.testing.assert_allclose(inverse @ lower, np.eye(size), rtol=0, atol=1e-14)
    assert not np.triu(inverse, 1).any()


def test_selected_rows_are_added_as_by_numpy(rng: np.random.Generator) -> None:
    to, rows = rng.integers(0, 7, 300), rng.integers(0, 11, 300)
    values, sums = rng.standard_normal((11, 5)), rng.standard_normal((7, 5))
    expected = sums.copy()
    np.add.at(expected, to, values[rows])
    _kernels.add_selected(to, rows, values, sums)
    np.testing.assert_allclose(sums, expected, rtol=1e-13)


@pytest.mark.parametrize(("kernel", "name"), _EVERY, ids=[f"{kernel}-{name}" for kernel, name in _EVERY])
def test_every_array_of_every_kernel_is_checked(tx90l: RobotModel, kernel: str, name: str) -> None:
    """Axes, extents, kind and, where it is written, order: one sentence that names the array, and no memory beyond it is read."""
    right = np.zeros((2, 7)) if (kernel, name) == ("geared_loop", "frictions") else np.zeros(_SHAPES[name])
    kind = np.int64 if name in _INDICES else np.float64
    wrong_shapes = [
        np.array(1.0),
        right.ravel()[:0],
        right[None],
        np.zeros((*right.shape[:-1], right.shape[-1] + 1)),
    ]
    for array in wrong_shapes:
        if name == "rows" and array.ndim == 2:
            continue  # as many as one likes
        with pytest.raises(ValueError, match=r"^[a-z_]+ must have the shape .*, not .*$"):
            _called(tx90l.tree, kernel, {name: array.astype(kind)})
    wrong_kinds = [
        right.astype(complex),
        right.astype(bool),
        right.astype(str),
        right.astype(object),
        right.tolist(),
    ]
    for array in [*wrong_kinds, *([right + 0.5] if name in _INDICES else [])]:
        with pytest.raises(TypeError, match=rf"^{name} must be an? .*array of (real |whole )?numbers$"):
            _called(tx90l.tree, kernel, {name: array})
    if name in _WRITTEN:
        fixed = right.copy()
        fixed.flags.writeable = False
        spread = np.zeros((*right.shape, 2))[..., 0]
        for array in (fixed, spread, right.astype(np.float32)):
            with pytest.raises(
                TypeError, match=rf"^{name} must be a writable C-contiguous array of float64$"
            ):
                _called(tx90l.tree, kernel, {name: array})


def test_what_is_read_is_converted(tx90l: RobotModel, rng: np.random.Generator) -> None:
    q = rng.integers(-2, 3, (4, 6))
    expected = _called(tx90l.tree, "point", {"q": q.astype(float)})
    for array in (q, np.asfortranarray(q.astype(float)), q.astype(np.float32)):
        found = _called(tx90l.tree, "point", {"q": array})
        np.testing.assert_array_equal(found[0], expected[0])  # pyright: ignore[reportIndexIssue]


@pytest.mark.parametrize(
    ("kernel", "changed", "words"),
    [
        ("point", {"joint": 6}, "joint is out of range"),
        ("equilibrium", {"payload_joint": 6}, "payload's joint is out of range"),
        ("equilibrium", {"axes": [(0, 2), (6, 2)]}, "no such elastic axis"),
        ("equilibrium", {"axes": [(0, 2), (0, 3)]}, "no such elastic axis"),
        ("torque_regressor", {"places": np.full((6, 60), 5)}, "beyond the rows"),
        ("torque_regressor_adjoint", {"places": np.full((6, 60), 5)}, "beyond the rows"),
        ("build", {"prismatic": [False]}, "one value per joint"),
        ("build", {"parents": [0, 0, 1]}, "before its child"),
        ("build", {"parents": [-2, 0, 1]}, "before its child"),
        ("closed_loop", {"step": 0}, "addresses"),
        ("closed_loop", {"substeps": 0}, "positive"),
        ("closed_loop", {"tick": float("nan")}, "positive"),
        ("closed_loop", {"motors": np.array([0, 4])}, "outside"),
        ("closed_loop", {"motors": np.array([0, 1]), "twists": np.array([4, -1])}, "outside"),
        ("geared_loop", {"motors": np.array([0, 4])}, "outside"),
        ("scatter_covariance", {"window": 0}, "between one"),
        ("scatter_covariance", {"window": 6}, "between one"),
        ("add_selected", {"to": np.full(4, 6), "source": np.zeros(4, int)}, "outside its array"),
        ("add_selected", {"to": np.zeros(4, int), "source": np.array([0, 1, 5, 2])}, "outside its array"),
        ("add_selected", {"to": np.zeros(4, int), "source": np.array([0, 1, -1, 2])}, "outside its array"),
    ],
)
def test_indices_and_numbers_are_checked(tx90l: RobotModel, kernel: str, changed: dict, words: str) -> None:
    others = next(entry[2] for entry in _KERNELS if entry[0] == kernel)
    plain = {name: value for name, value in changed.items() if name in others}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in plain.items():
            patch.setitem(others, name, value)
        with pytest.raises(ValueError, match=words):
            _called(tx90l.tree, kernel, {name: value for name, value in changed.items() if name not in plain})
