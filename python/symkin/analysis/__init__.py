# SPDX-License-Identifier: MIT
"""What is known of a mechanism before anything is measured, and how well it does."""
