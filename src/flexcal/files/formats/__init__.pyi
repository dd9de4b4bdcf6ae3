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
from .npz_reader import ArrayForm, NpzFile, refuse_foreign
from .npz_writer import write_npz
from .yaml_reader import YamlFile, read_yaml, read_yaml_file
from .yaml_writer import to_plain, write_yaml, yaml_text

__all__ = [
    "BLOCKS",
    "ArrayForm",
    "Block",
    "NpzFile",
    "YamlFile",
    "block_sha256",
    "json_values",
    "provenance",
    "read_estimates",
    "read_yaml",
    "read_yaml_file",
    "refuse_foreign",
    "require_place",
    "sha256_of",
    "to_plain",
    "write_estimates",
    "write_npz",
    "write_yaml",
    "yaml_text",
]
