# SPDX-License-Identifier: MIT
from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import symkin
from symkin.files.mechanism_schema import mechanism_schema
from symkin.storage.toml_file import read_toml


@pytest.fixture(scope="module")
def schema() -> Any:
    return mechanism_schema()


def alternative(schema: Any, chain: str, platform: str = "rigid") -> Any:
    for found in schema["anyOf"]:
        properties = found["properties"]
        if (properties["chain"].get("const"), properties["platform"].get("const")) == (
            chain,
            platform,
        ):
            return found
    raise AssertionError(f"no alternative for {chain} {platform}")


def fits(value: Any, schema: Any) -> bool:
    """The few words of JSON Schema that are used."""
    if "anyOf" in schema:
        return any(fits(value, each) for each in schema["anyOf"])
    if "const" in schema or "enum" in schema:
        return value in schema.get("enum", [schema.get("const")])
    names = {"array": list, "object": dict, "string": str, "integer": int, "number": int | float}
    kinds = schema.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if kinds and not any(isinstance(value, names[kind]) for kind in kinds):
        return False
    if isinstance(value, dict):
        known = schema.get("properties", {})
        others = schema.get("additionalProperties", {})
        if others is False and not set(value) <= set(known):
            return False
        return set(schema.get("required", ())) <= set(value) and all(
            fits(item, known.get(key, others)) for key, item in value.items()
        )
    if isinstance(value, list):
        count = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
        kinds = schema.get("prefixItems") or [schema.get("items", {})] * len(value)
        return count and all(map(fits, value, kinds))
    if isinstance(value, str):
        return len(value) <= schema.get("maxLength", len(value))
    return schema.get("minimum", value) <= value <= schema.get("maximum", value)


@pytest.mark.parametrize("name", symkin.shipped_mechanisms())
def test_a_shipped_file_fits_the_schema_and_a_misspelt_one_does_not(schema: Any, name: str) -> None:
    source = symkin.load_mechanism(name).source
    assert source is not None
    values = read_toml(source).values
    assert fits(values, schema)
    assert not fits({**values, "nosie": {}}, schema)
    assert not fits({**values, "protocol": {"seed": -1}}, schema)


def test_the_module_prints_the_schema(schema: Any) -> None:
    command = [sys.executable, "-m", "symkin.files.mechanism_schema"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert json.loads(printed) == schema


def test_every_chain_has_an_alternative(schema: Any) -> None:
    for chain in symkin.chains():
        assert alternative(schema, chain)["required"] == ["schema", "chain"]
    for chain in symkin.chains("point"):
        assert "platform" in alternative(schema, chain, "point")["required"]


def test_a_leg_requires_exactly_the_parameters_of_its_chain(schema: Any) -> None:
    for name in ("reference_leg", "legs"):
        section = alternative(schema, "[R]RR")["properties"][name]
        legs = section.get("items", section)["anyOf"]
        names = set(symkin.chain_info("[R]RR").parameter_names)
        leg = legs[0]
        assert set(leg["required"]) == names
        curvature = (
            {"sensor_quadratic", "sensor_cosine", "sensor_sine"} if name == "legs" else set()
        )
        assert set(leg["properties"]) == names | {"chain", "working_mode"} | curvature
        assert leg["additionalProperties"] is False
        polar = {f"{end}_{what}" for end in ("base", "platform") for what in ("radius", "angle")}
        assert set(legs[-1]["required"]) == (names - polar) | {"base_point", "platform_point"}


def test_the_schema_has_no_null_since_toml_has_none(schema: Any) -> None:
    assert '"null"' not in json.dumps(schema, allow_nan=False)


ROOT = Path(__file__).parents[3]
DECLARED = sorted(
    [
        *(ROOT / "mechanisms" / "declared").glob("*.toml"),
        *(ROOT.parent / "shared" / "reference" / "declared_legs").glob("*.toml"),
    ]
)


@pytest.mark.parametrize("path", DECLARED, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_a_file_that_declares_its_legs_fits_the_schema(schema: Any, path: Path) -> None:
    values = read_toml(path).values
    assert fits(values, schema)
    assert not fits({**values, "nosie": {}}, schema)
    workspace = values["workspace"]
    assert not fits({**values, "workspace": {**workspace, "hoem": []}}, schema)
    for name, chain in values.get("chains", {}).items():
        wrong = {**values["chains"], name: {**chain, "paths": []}}
        assert not fits({**values, "chains": wrong}, schema)
