"""Colours of the scene, (3,) red, green, blue from 0 to 255; each is readable on the light and on the dark ground of viser."""

from __future__ import annotations

LINK = (158, 168, 179)
GHOST = (90, 157, 240)
BLOCKED = (217, 84, 30)
COLLIDING = (214, 47, 47)
MEASURED = (58, 130, 224)
TARGET = (125, 134, 144)
SELECTED = (240, 178, 20)
LINE_OF_SIGHT = (58, 160, 110)
INSTRUMENT = (98, 110, 124)
GRID = (134, 142, 150)
