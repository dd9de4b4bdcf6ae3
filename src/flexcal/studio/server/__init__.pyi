from .answer import NO_CONTENT, Answer, Route, said
from .gate import Gate, Passage
from .project_files import ProjectFiles
from .studio_server import StudioServer
from .upload_limit import limit_uploads

__all__ = [
    "NO_CONTENT",
    "Answer",
    "Gate",
    "Passage",
    "ProjectFiles",
    "Route",
    "StudioServer",
    "limit_uploads",
    "said",
]
