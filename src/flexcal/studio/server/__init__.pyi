from .answer import NO_CONTENT, Answer, Route, said
from .browser_page import redirecting_page
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
    "redirecting_page",
    "said",
]
