# SPDX-License-Identifier: MIT
"""Mechanism files: read, checked, written, begun."""
