# SPDX-License-Identifier: MIT
from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import symkin
from symkin.io.json_schema import mechanism_schema, mechanism_schema_text

PUBLISHED = Path(__file__).parents[3] / "docs" / "mechanism.schema.json"


@pytest.fixture(scope="module")
def schema() -> Any:
    return mechanism_schema()


def alternative(schema: Any, chain: str, platform: str = "rigid") -> Any:
    for reference in schema["anyOf"]:
        found = schema["$defs"][reference["$ref"].removeprefix("#/$defs/")]
        properties = found["properties"]
        if (properties["chain"]["const"], properties["platform"]["const"]) == (chain, platform):
            return found
    raise AssertionError(f"no alternative for {chain} {platform}")


def test_the_published_schema_is_current() -> None:
    current = mechanism_schema_text() == PUBLISHED.read_text(encoding="utf-8")
    assert current, "run: python -m symkin.io.json_schema > docs/mechanism.schema.json"


def test_every_chain_has_an_alternative(schema: Any) -> None:
    for chain in symkin.chains():
        assert alternative(schema, chain)["required"] == ["schema", "chain"]
    for chain in symkin.chains("point"):
        assert "platform" in alternative(schema, chain, "point")["required"]


def test_a_leg_requires_exactly_the_parameters_of_its_chain(schema: Any) -> None:
    definitions = schema["$defs"]
    for name in ("reference_leg", "legs"):
        section = alternative(schema, "[R]RR")["properties"][name]
        reference = section.get("items", section)["$ref"]
        leg = definitions[reference.removeprefix("#/$defs/")]
        names = set(symkin.chain_info("[R]RR").parameter_names)
        assert set(leg["required"]) == names
        assert set(leg["properties"]) == names | {"working_mode"}
        assert leg["additionalProperties"] is False


def test_the_schema_has_no_null_since_toml_has_none(schema: Any) -> None:
    assert '"null"' not in json.dumps(schema)
