import numpy as np

avx2: bool

class RuntimeRobot:
    @staticmethod
    def read(text: str) -> RuntimeRobot: ...
    joint_names: list[str]
    point_names: list[str]
    @staticmethod
    def describe(status: int) -> str: ...
    def forward(
        self, q: np.ndarray, point: int, payload: np.ndarray, flank: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...
    def nominal(self, q: np.ndarray, point: int) -> tuple[np.ndarray, np.ndarray]: ...
    def beyond(self, q: np.ndarray, point: int) -> np.ndarray: ...
    def compensate(
        self, q: np.ndarray, point: int, payload: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...
    def torque(
        self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, payload: np.ndarray, elastic: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...
    def inverse(
        self, position: np.ndarray, rotation: np.ndarray, near: np.ndarray, point: int, payload: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...

class Tree:
    @staticmethod
    def build(
        parents: list[int],
        prismatic: list[bool],
        placements: np.ndarray,
        translations: np.ndarray,
        normals: np.ndarray,
        bearings: np.ndarray,
        tilts_first: bool = False,
    ) -> Tree: ...
    def point(
        self,
        joint: int,
        placement: np.ndarray,
        translation: np.ndarray,
        target: np.ndarray,
        geometry: np.ndarray,
        tool: np.ndarray,
        q: np.ndarray,
        deflection: np.ndarray,
        jacobians: bool,
        parameters: bool = True,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]: ...
    def equilibrium(
        self,
        axes: list[tuple[int, int]],
        stiffness: np.ndarray,
        geometry: np.ndarray,
        mass: np.ndarray,
        first_moment: np.ndarray,
        payload: np.ndarray,
        payload_joint: int,
        payload_point: np.ndarray,
        gravity: np.ndarray,
        q: np.ndarray,
        sensitivities: bool,
        parameters: bool = True,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]: ...
    def gravity_loads(
        self,
        axes: list[tuple[int, int]],
        geometry: np.ndarray,
        mass: np.ndarray,
        first_moment: np.ndarray,
        payload: np.ndarray,
        payload_joint: int,
        payload_point: np.ndarray,
        gravity: np.ndarray,
        q: np.ndarray,
        deflection: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]: ...
    def torque_regressor(
        self,
        geometry: np.ndarray,
        gravity: np.ndarray,
        q: np.ndarray,
        dq: np.ndarray,
        ddq: np.ndarray,
        places: np.ndarray,
        out: np.ndarray,
    ) -> None: ...
    def torque_regressor_adjoint(
        self,
        geometry: np.ndarray,
        gravity: np.ndarray,
        q: np.ndarray,
        dq: np.ndarray,
        ddq: np.ndarray,
        places: np.ndarray,
        weights: np.ndarray,
    ) -> np.ndarray: ...

def update(triangle: np.ndarray, rows: np.ndarray) -> None: ...
def scatter_covariance(
    white: np.ndarray,
    right: np.ndarray,
    left: np.ndarray,
    window: int,
    freedom: float,
    covariance: np.ndarray,
) -> None: ...
def triangular_inverse(lower: np.ndarray, inverse: np.ndarray) -> None: ...
def add_selected(to: np.ndarray, source: np.ndarray, values: np.ndarray, sums: np.ndarray) -> None: ...
def closed_loop(
    step: int,
    model: int,
    data: int,
    position: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
    springs: np.ndarray,
    frictions: np.ndarray,
    motors: np.ndarray,
    twists: np.ndarray,
    proportional: np.ndarray,
    derivative: np.ndarray,
    tick: float,
    substeps: int,
    encoder_resolution: float,
    rate_filter: float,
    feed_forward: np.ndarray,
    reference: np.ndarray,
    reference_rate: np.ndarray,
    position_log: np.ndarray,
    torque_log: np.ndarray,
    arm_log: np.ndarray,
    state_log: np.ndarray | None = None,
) -> int: ...
def geared_loop(
    step: int,
    model: int,
    data: int,
    angle: np.ndarray,
    velocity: np.ndarray,
    applied: np.ndarray,
    hinges: np.ndarray,
    motors: np.ndarray,
    twists: np.ndarray,
    frictions: np.ndarray,
    errors: np.ndarray,
    gains: np.ndarray,
    tick: float,
    substeps: int,
    count: float,
    filter: float,
    torque: np.ndarray,
    reference: np.ndarray,
    reference_rate: np.ndarray,
    angle_log: np.ndarray,
    torque_log: np.ndarray,
) -> int: ...
