"""Uploads that are too large to be kept in memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser


def limit_uploads(server: viser.ViserServer, largest: int, refused: Callable[[str, int], None]) -> None:
    """Drop uploads of more than `largest` bytes as they begin, and those that turn out to be larger than they said.

    viser collects an upload in memory before it is looked at. `refused` is called with name and size of a dropped one, in viser's thread.
    """
    from viser._messages import FileTransferPart, FileTransferPartAck, FileTransferStartUpload

    gui, connections = server.gui, server.gui._websock_interface
    uploads = gui._current_file_upload_states

    def started(_client: int, message: FileTransferStartUpload) -> None:
        if message.size_bytes > largest and uploads.pop(message.transfer_uuid, None) is not None:
            # the page waits for all of it to have arrived
            done = FileTransferPartAck(
                message.source_component_uuid, message.transfer_uuid, message.size_bytes, message.size_bytes
            )
            connections.queue_message(done)
            refused(message.filename, message.size_bytes)

    def came(_client: int, message: FileTransferPart) -> None:
        upload = uploads.get(message.transfer_uuid)
        if upload is not None and upload["transferred_bytes"] > largest:
            uploads.pop(message.transfer_uuid, None)
            refused(upload["filename"], upload["transferred_bytes"])

    connections.register_handler(FileTransferStartUpload, started)
    connections.register_handler(FileTransferPart, came)
