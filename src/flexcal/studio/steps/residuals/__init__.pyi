from .residuals_view import ResidualsView

__all__ = ["ResidualsView"]
