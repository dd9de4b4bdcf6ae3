"""What surrounds the robot: ground, axes, light and the view with which a window starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexcal.studio.scene.colours import GRID

if TYPE_CHECKING:
    import viser

_DIRECTION = np.array([0.85, -1.0, 0.6])
"""From the robot to the camera."""
_METRES = 3
"""From the robot to the edges of the ground."""
_VIEW = np.deg2rad(45)


class Surroundings:
    """Ground with a line each metre, axes of the base frame, and light.

    Lines in place of viser's grid, no shadows and no reflected environment: on a processor without graphics each of these would take
    a third of the time of a frame.
    """

    def __init__(self, scene: viser.SceneApi, name: str = "/surroundings") -> None:
        scene.set_up_direction("+z")
        scene.configure_default_lights(cast_shadow=False)
        scene.configure_environment_map(None)
        scene.add_light_hemisphere(
            f"{name}/sky", sky_color=(255, 255, 255), ground_color=(150, 150, 150), intensity=1.6
        )
        at = np.arange(-_METRES, _METRES + 1.0)
        ends = np.stack([np.full_like(at, -_METRES), np.full_like(at, _METRES)], axis=1)
        across, level = np.repeat(at[:, None], 2, axis=1), np.zeros((len(at), 2))
        lines = np.concatenate([np.stack([across, ends, level], -1), np.stack([ends, across, level], -1)])
        scene.add_line_segments(f"{name}/ground", lines, GRID, thickness=1.0, thickness_units="screen")
        scene.add_frame(f"{name}/axes", axes_length=0.2, axes_radius=0.005, origin_radius=0.008)

    def frame(self, camera: viser.InitialCameraConfig, reach: float) -> None:
        """Start windows with a `camera` that sees a robot of this `reach`, m, from the front right."""
        centre = np.array([0.0, 0.0, 0.35 * reach])
        camera.look_at = centre
        camera.position = centre + 2.1 * reach * _DIRECTION / np.linalg.norm(_DIRECTION)
        camera.fov = float(_VIEW)
        camera.near, camera.far = 0.02, max(40.0, 20.0 * reach)
