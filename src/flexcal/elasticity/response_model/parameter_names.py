"""Names of the parameters of stage 1: those of estimates.yaml, and those that belong to one pose."""

from __future__ import annotations

from collections.abc import Sequence

from flexcal.frequency.periodic import FrequencyResponse


def pose_labels(responses: Sequence[FrequencyResponse]) -> tuple[str, ...]:
    """Label of every response: its pose number in the plan, or its index where numbers repeat."""
    numbers = [response.pose for response in responses]
    if len(set(numbers)) < len(numbers):
        numbers = range(len(responses))
    return tuple(f"pose_{number + 1}" for number in numbers)


def viscous_name(joint: str, pose: str) -> str:
    """Name of a motor's viscous coefficient in one pose."""
    return f"{joint}.viscous.{pose}"


def backlash_name(joint: str) -> str:
    """Name of the half gap of a drive as identified from frequency responses."""
    return f"{joint}.drive.half_gap"


def hardening_name(joint: str) -> str:
    """Name of the hardening of a drive."""
    return f"{joint}.drive.hardening"


def slip_share_name(joint: str) -> str:
    """Name of the stiffness of a drive's slipping spring, over that of the drive: its hysteresis."""
    return f"{joint}.drive.slip_share"


def slip_twist_name(joint: str) -> str:
    """Name of the twist at which a drive's slipping spring slips."""
    return f"{joint}.drive.slip_twist"


def held_inertia_name(joint: str) -> str:
    """Name of the inertia that moves with the arm at a joint with held motor."""
    return f"{joint}.held_inertia"
