#define BOOST_TEST_MODULE transfer
#include <boost/test/unit_test.hpp>

#include <peat/transfer/weights.h>

#include <deal.II/fe/fe_q.h>

#include <random>

// The kernels' shape functions against deal.II's, and the properties that transfers rely on.

using namespace peat;

namespace {
std::mt19937 generator(42);

Lanes random_lanes(const double lower, const double upper)
{
  std::uniform_real_distribution<double> uniform(lower, upper);
  Lanes x;
  for (unsigned int l = 0; l < n_lanes; ++l)
    x[l] = uniform(generator);
  return x;
}

template <int dim>
void compare_with_fe_q()
{
  const dealii::FE_Q<dim> element(1);
  std::array<CellInterval, dim> cell;
  Weights<dim, 2> w;
  std::array<Lanes, dim> xi;
  for (unsigned int d = 0; d < dim; ++d) {
    cell[d] = {1.5 * d - 0.7, 0.3 + 0.2 * d, 0.1, 0.4};
    xi[d] = random_lanes(0., 1.);
    evaluate_direction(cell[d].lower + cell[d].size * xi[d], Lanes{}, cell[d], w[d]);
  }
  for (unsigned int i = 0; i < element.dofs_per_cell; ++i) {
    double nodal[8] = {};
    nodal[i] = 1.;
    Lanes value, gradient[dim];
    interpolate<dim, 2>(nodal, w, value, gradient);
    const Lanes value_alone = interpolate<dim, 2>(nodal, w);
    for (unsigned int l = 0; l < n_lanes; ++l) {
      dealii::Point<dim> unit;
      for (unsigned int d = 0; d < dim; ++d)
        unit[d] = xi[d][l];
      // Both evaluate products of dim factors of order one: a few units in the last place.
      BOOST_TEST(std::abs(value[l] - element.shape_value(i, unit)) < 1e-14);
      BOOST_TEST(std::abs(value_alone[l] - value[l]) < 1e-14);
      for (unsigned int d = 0; d < dim; ++d) {
        const double expected = element.shape_grad(i, unit)[d] / cell[d].size;
        BOOST_TEST(std::abs(gradient[d][l] - expected) < 1e-13);
        const Lanes derivative_alone = derivative<dim, 2>(nodal, w, d);
        BOOST_TEST(std::abs(derivative_alone[l] - expected) < 1e-13);
      }
    }
  }
}

/// The mean of a hat function over [a, b] by fine midpoint quadrature within each smooth piece.
double mean_of_hat(const double a, const double b, const double left, const double middle, const double right)
{
  const auto hat = [&](const double x) {
    if (x <= left || x >= right)
      return 0.;
    return x < middle ? (x - left) / (middle - left) : (right - x) / (right - middle);
  };
  const unsigned int n = 20000;
  double sum = 0.;
  for (unsigned int i = 0; i < n; ++i)
    sum += hat(a + (b - a) * (i + 0.5) / n);
  return sum / n;
}
} // namespace

BOOST_AUTO_TEST_CASE(q1_is_fe_q)
{
  compare_with_fe_q<2>();
  compare_with_fe_q<3>();
}

BOOST_AUTO_TEST_CASE(gimp_is_the_mean_of_q1_over_the_domain)
{
  const CellInterval cell{1., 0.5, 0.25, 0.75};
  const double node[6] = {0.5, 0.75, 1., 1.5, 2.25, 3.};
  const Lanes x = random_lanes(1., 1.5), half = random_lanes(0.01, 0.125);
  DirectionWeights<4> w;
  evaluate_direction(x, half, cell, w);
  for (unsigned int l = 0; l < n_lanes; ++l) {
    double total = 0., slope = 0., moment = 0.;
    for (unsigned int k = 0; k < 4; ++k) {
      const double expected = mean_of_hat(x[l] - half[l], x[l] + half[l], node[k], node[k + 1], node[k + 2]);
      // The quadrature misses the kinks by at most one of its 20000 intervals.
      BOOST_TEST(std::abs(w.value[k][l] - expected) < 1e-7);
      total += w.value[k][l];
      slope += w.slope[k][l];
      moment += w.value[k][l] * node[k + 1];
    }
    BOOST_TEST(std::abs(total - 1.) < 1e-14);
    BOOST_TEST(std::abs(slope) < 1e-13);
    BOOST_TEST(std::abs(moment - x[l]) < 1e-14);
  }
}

BOOST_AUTO_TEST_CASE(gimp_of_a_domain_inside_its_cell_is_q1)
{
  const CellInterval cell{-1., 2., 1., 1.};
  const Lanes x = random_lanes(-0.4, 0.4), half = broadcast(0.5);
  DirectionWeights<4> gimp;
  DirectionWeights<2> q1;
  evaluate_direction(x, half, cell, gimp);
  evaluate_direction(x, half, cell, q1);
  for (unsigned int l = 0; l < n_lanes; ++l) {
    for (unsigned int k = 0; k < 2; ++k) {
      BOOST_TEST(std::abs(gimp.value[k + 1][l] - q1.value[k][l]) < 1e-15);
      BOOST_TEST(std::abs(gimp.slope[k + 1][l] - q1.slope[k][l]) < 1e-15);
    }
    BOOST_TEST(gimp.value[0][l] == 0.);
    BOOST_TEST(gimp.value[3][l] == 0.);
  }
}

BOOST_AUTO_TEST_CASE(gimp_keeps_the_partition_of_unity_at_the_edge_of_the_mesh)
{
  const CellInterval cell{0., 1., 0., 1.};
  DirectionWeights<4> w;
  evaluate_direction(random_lanes(0., 0.2), broadcast(0.25), cell, w);
  for (unsigned int l = 0; l < n_lanes; ++l) {
    BOOST_TEST(std::abs(w.value[1][l] + w.value[2][l] + w.value[3][l] - 1.) < 1e-14);
    BOOST_TEST(w.value[0][l] == 0.);
  }
}
