from .answers import Answers
from .first_problems import FirstProblems
from .server import Served, serve_tcp, serve_unix

__all__ = ["Answers", "FirstProblems", "Served", "serve_tcp", "serve_unix"]
