from .plan_step import PlanStep

__all__ = ["PlanStep"]
