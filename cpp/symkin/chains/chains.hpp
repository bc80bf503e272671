// SPDX-License-Identifier: MIT
#pragma once

// One struct a chain, and the registry that finds it by name. Public: the registry.
#include "symkin/chains/registry.hpp"
