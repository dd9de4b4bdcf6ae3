from .estimates_file import (
    BLOCKS,
    Block,
    block_sha256,
    provenance,
    read_estimates,
    require_place,
    sha256_of,
    write_estimates,
)
from .json_conversion import json_values
from .json_reader import parse_json, read_json
from .npz_reader import ArrayForm, NpzFile, refuse_foreign
from .npz_writer import write_npz
from .yaml_document import parse_document
from .yaml_editor import REMOVED, Removed, edited_yaml
from .yaml_places import Node, Place, yaml_nodes
from .yaml_reader import YamlFile, read_yaml, read_yaml_file
from .yaml_writer import to_plain, write_yaml, yaml_text

__all__ = [
    "BLOCKS",
    "REMOVED",
    "ArrayForm",
    "Block",
    "Node",
    "NpzFile",
    "Place",
    "Removed",
    "YamlFile",
    "block_sha256",
    "edited_yaml",
    "json_values",
    "parse_document",
    "parse_json",
    "provenance",
    "read_estimates",
    "read_json",
    "read_yaml",
    "read_yaml_file",
    "refuse_foreign",
    "require_place",
    "sha256_of",
    "to_plain",
    "write_estimates",
    "write_npz",
    "write_yaml",
    "yaml_nodes",
    "yaml_text",
]
