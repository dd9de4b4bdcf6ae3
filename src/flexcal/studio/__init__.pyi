from .application import run_studio

__all__ = ["run_studio"]
