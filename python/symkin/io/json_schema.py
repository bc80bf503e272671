# SPDX-License-Identifier: MIT
"""The JSON Schema of mechanism files, for editors that complete and check TOML."""

from __future__ import annotations

import json
import sys
from typing import Any, Union

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

import symkin
from symkin.io.mechanism_schema import mechanism_model

__all__ = ["mechanism_schema", "mechanism_schema_text"]


def mechanism_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of mechanism files, one alternative per chain.

    Returns
    -------
    dict
    """
    models = tuple(
        mechanism_model(chain, platform, None)
        for platform in ("rigid", "point")
        for chain in symkin.chains(platform)
    )
    alternatives: Any = Union[models]  # noqa: UP007  # made at run time
    schema = TypeAdapter(alternatives).json_schema(schema_generator=_WithoutNull)
    shared: dict[str, Any] = {}
    schema = _with_shared_quantities(schema, shared)
    schema["$defs"] |= shared
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "symkin mechanism file",
        **schema,
    }


def mechanism_schema_text() -> str:
    """Return the JSON Schema as the text of the published file."""
    return json.dumps(mechanism_schema(), indent=2, sort_keys=True) + "\n"


def _with_shared_quantities(node: Any, shared: dict[str, Any]) -> Any:
    """Move the quantities, which every leg repeats, to definitions by their titles."""
    if isinstance(node, list):
        return [_with_shared_quantities(item, shared) for item in node]
    if not isinstance(node, dict):
        return node
    moved = {key: _with_shared_quantities(value, shared) for key, value in node.items()}
    title = moved.get("title")
    if not isinstance(title, str) or not title.startswith(("Quantity_", "Estimate_")):
        return moved
    default = {"default": moved.pop("default")} if "default" in moved else {}
    shared[title] = {key: value for key, value in moved.items() if key != "title"}
    return {"$ref": f"#/$defs/{title}", **default}


class _WithoutNull(GenerateJsonSchema):
    """TOML has no null, and the keys are their own titles."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        described = super().default_schema(schema)
        return {key: value for key, value in described.items() if value is not None}

    def field_title_should_be_set(self, schema: Any) -> bool:  # noqa: ARG002
        return False


if __name__ == "__main__":
    sys.stdout.write(mechanism_schema_text())
