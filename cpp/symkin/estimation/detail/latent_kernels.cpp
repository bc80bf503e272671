// SPDX-License-Identifier: MIT

// Compiled twice on x86-64, see chains/detail/kernels.hpp: a pose a lane. Nothing is transposed or
// scattered: what the poses say is summed in lanes, which are added up once at the end.
#include "symkin/estimation/detail/latent_kernels.hpp"

#include "symkin/estimation/detail/kernels_of_processor.hpp"
#include "symkin/estimation/detail/latent_elimination.hpp"
#include "symkin/estimation/detail/latent_sums.hpp"

namespace symkin {
namespace detail {

// What `visit` does with the kernels for so many degrees of freedom and, where a pose was measured
// in full and every one has its leg, for so many rows.
template <typename T, int kDof, typename Visit>
void of_rows(const LatentRows& rows, const Visit& visit) {
  rows.rows == 2 * kDof ? visit(LatentElimination<T, kDof, 2 * kDof>())
                        : visit(LatentElimination<T, kDof, 0>());
}

template <typename T, typename Visit>
void of_size(const LatentRows& rows, const Visit& visit) {
  rows.dof == 6   ? of_rows<T, 6>(rows, visit)
  : rows.dof == 4 ? of_rows<T, 4>(rows, visit)
  : rows.dof == 3 ? of_rows<T, 3>(rows, visit)
                  : of_rows<T, 2>(rows, visit);
}

template <typename T>
void eliminate(const LatentRows& rows) {
  of_size<T>(rows, [&](auto lanes) { decltype(lanes)::eliminate(rows); });
}

template <typename T>
void add(const LatentRows& rows, const double* weights, double* information, double* gradient) {
  LatentSums<T>(rows, weights, information == nullptr).add(information, gradient);
}

template <typename T>
void move(const LatentRows& rows, const double* step, double* tangents, double* errors) {
  of_size<T>(rows, [&](auto lanes) { decltype(lanes)::move(rows, step, tangents, errors); });
}

template <typename T>
struct LatentKernelsOf {
  static constexpr LatentKernels kTable{Lanes<T>::kCount, eliminate<T>, add<T>, move<T>};
};

}  // namespace detail

SYMKIN_KERNELS_OF_PROCESSOR(LatentKernels, latent_kernels, detail::LatentKernelsOf)

}  // namespace symkin
