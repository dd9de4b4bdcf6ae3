from .answers import Answers
from .server import Served, serve_tcp, serve_unix

__all__ = ["Answers", "Served", "serve_tcp", "serve_unix"]
