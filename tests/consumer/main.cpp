// SPDX-License-Identifier: MIT
#include <symkin/chains/rrr.hpp>
#include <symkin/model/leg_model_of.hpp>
#include <symkin/support/support.hpp>
#include <symkin/symkin.hpp>

int main() {
  const symkin::LegModelOf<symkin::RrrActive1> own;
  const auto& model = symkin::leg_model("[R]RR", symkin::Platform::rigid);
  const symkin::RowMatrix none = symkin::RowMatrix::Zero(9, 9);
  const symkin::RowMatrix sum = symkin::product(none, none);
  return own.info().name != model.info().name || !sum.isZero(0);
}
