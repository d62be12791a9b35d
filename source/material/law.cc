#include <peat/material/law.h>
#include <peat/material/tensor.h>

namespace peat {
ElasticModuli::ElasticModuli(Section section)
{
  double E = 1e7, nu = 0.3;
  section.add("Young modulus", E, positive("Pa"), "Young's modulus of the skeleton at small strain.");
  section.add("Poisson ratio", nu, strictly_between(-1., 0.5),
              "Poisson's ratio of the skeleton at small strain.");
  mu = E / (2. * (1. + nu));
  lambda = E * nu / ((1. + nu) * (1. - 2. * nu));
}

Spectrum::Spectrum(const StressLanes &a)
    : vectors{broadcast(1.), broadcast(0.), broadcast(0.), broadcast(0.), broadcast(1.),
              broadcast(0.), broadcast(0.), broadcast(0.), broadcast(1.)}
{
  constexpr unsigned int most_sweeps = 8;
  constexpr double negligible = 1e-17;

  StressLanes d = a;
  for (unsigned int sweep = 0; sweep < most_sweeps; ++sweep) {
    for (unsigned int p = 0; p < 3; ++p) {
      const unsigned int q = (p + 1) % 3, r = (p + 2) % 3;
      Lanes &pq = d[symmetric_index[p][q]], &rp = d[symmetric_index[r][p]], &rq = d[symmetric_index[r][q]];
      // The smaller rotation that makes (p, q) vanish.
      const Lanes difference = d[q] - d[p];
      const Lanes root = sqrt(difference * difference + 4. * pq * pq) + std::numeric_limits<double>::min();
      const Lanes t =
          (difference < 0. ? -2. * pq : 2. * pq) / ((difference < 0. ? -difference : difference) + root);
      const Lanes c = 1. / sqrt(1. + t * t), s = t * c;
      d[p] -= t * pq;
      d[q] += t * pq;
      pq = broadcast(0.);
      const Lanes old_rp = rp;
      rp = c * old_rp - s * rq;
      rq = s * old_rp + c * rq;
      for (unsigned int i = 0; i < 3; ++i) {
        const Lanes vp = vectors[3 * i + p], vq = vectors[3 * i + q];
        vectors[3 * i + p] = c * vp - s * vq;
        vectors[3 * i + q] = s * vp + c * vq;
      }
    }
    const Lanes off = d[3] * d[3] + d[4] * d[4] + d[5] * d[5];
    const Lanes size = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (sum(off > negligible * negligible * size ? broadcast(1.) : broadcast(0.)) == 0.)
      break;
  }
  values = {d[0], d[1], d[2]};
}
} // namespace peat
