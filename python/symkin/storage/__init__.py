# SPDX-License-Identifier: MIT
"""Files without a meaning of their own: written whole or not at all, tables, TOML, units."""
