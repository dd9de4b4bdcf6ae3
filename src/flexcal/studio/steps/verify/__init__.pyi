from .verify_step import VerifyStep

__all__ = ["VerifyStep"]
