"""Plane P waves in the u-p medium: dispersion, attenuation, limits; free decay of one standing mode (exact).

u = U exp(i(w t - kz)): gamma = i k:  with s = i w  (see up_column.gammas)
  M K g^4 - [M s/Q + (rho - alpha rho_f) K s^2 + alpha^2 s] g^2 + rho s^3/Q = 0,  g = gamma.
phase speed c = w/|Im g|, attenuation (1/m) = |Re g|, 1/q_factor = 2 Re g/Im g.
Two branches (small |g^2| first); crossover w_c = (M/Q + alpha^2)/((rho - alpha rho_f) K):
  branch 1, w << w_c : propagating, undrained  c_u = sqrt((M + alpha^2 Q)/rho), damping ~ w^2
  branch 1, w >> w_c : DIFFUSIVE, D_hf = Q K (rho - alpha rho_f)/rho, apparent speed sqrt(2 D_hf w)   ('up0': Q K)
  branch 2, w << w_c : diffusive, D = c_v = K/(1/Q + alpha^2/M), apparent speed sqrt(2 c_v w)
  branch 2, w >> w_c : propagating skeleton wave  c_hf = sqrt(M/(rho - alpha rho_f))   ('up0': sqrt(M/rho))
  i.e. the u-p model is parabolic in p: it has no finite fast front above w_c, unlike full Biot ('uwp'), whose speeds
  tend to biot_hf().  For incompressible constituents w_c ~ alpha^2/((rho-alpha rho_f)K), cf. Biot's n g/k.
standing(): u = U(t) sin(b z), p = P(t) cos(b z): the 3x3 ODE of up_column with q=0, exact by eigenvalues;
initial value U(0)=0, V(0)=v0, P(0)=0.  Best single check of a code's wave speed/attenuation (periodic or roller box).
"""
import numpy as np
from up_column import gammas


def waves(w, form="up", n=0.4, **P):
    s = 1j * np.asarray(w, float)
    gf, gs, _, _ = gammas(s, n=n, form=form, **P)
    out = []
    for g2 in (gf, gs):
        g = np.sqrt(g2); g = np.where(g.real < 0, -g, g)
        out.append((np.asarray(w) / np.abs(g.imag), g.real))
    return out      # [(c_fast, att_fast), (c_slow, att_slow)]


def limits(M, K, Q, alpha, rho, rho_f):
    return dict(c_u=np.sqrt((M + alpha**2 * Q) / rho), c_hf=np.sqrt(M / (rho - alpha * rho_f)), c_d=np.sqrt(M / rho),
                w_c=(M / Q + alpha**2) / ((rho - alpha * rho_f) * K), c_v=K / (1 / Q + alpha**2 / M), D_hf=Q * K * (rho - alpha * rho_f) / rho)


def biot_hf(M, Q, alpha, rho, rho_f, n):
    """lossless high-frequency Biot speeds (tortuosity 1 as in eq. (1b) of Zhang, Wang and Chen 2009): K(s) -> n/(rho_f s)."""
    # det: (M g2 - (rho - n rho_f) s2)(n/rho_f g2 - s2/Q) - (alpha-n)(alpha-n) s2 g2 = 0, x = g2/s2
    r = rho - n * rho_f
    co = [M * n / rho_f, -(M / Q + r * n / rho_f + (alpha - n)**2), r / Q]
    x = np.roots(co).real
    return np.sort(1 / np.sqrt(x))[::-1]


def standing(t, b, v0, M, K, Q, alpha, rho, rho_f, form="up"):
    rf = rho_f if form == "up" else 0.0
    A = np.array([[0, 1, 0], [-M * b**2 / rho, 0, alpha * b / rho], [0, 0, 0]], float)
    A[2] = Q * K * rf * b * A[1]; A[2, 2] += -Q * K * b**2; A[2, 1] += -Q * alpha * b
    sc = np.array([1 / b, np.sqrt(M / rho), np.sqrt(M * Q)])
    lam, V = np.linalg.eig(A * sc[None, :] / sc[:, None])
    c = np.linalg.solve(V, np.array([0, v0, 0]) / sc)
    y = np.real(V @ (c[:, None] * np.exp(np.outer(lam, np.atleast_1d(t))))) * sc[:, None]
    return y[0], y[1], y[2], lam


if __name__ == "__main__":
    from scipy.integrate import solve_ivp
    for k in (1e-2, 1e-3, 1e-4, 1e-5):
        P = dict(M=2.2333e7, K=k / 9810, Q=5e9, alpha=1.0, rho=1670.0, rho_f=1000.0)
        L = limits(**P)
        w = L["w_c"] * np.array([1e-4, 1e-2, 1, 1e2, 1e4, 1e6])
        (c1, a1), (c2, a2) = waves(w, **P); cb = waves(w, form="uwp", n=.33, **P)[0][0]; (d1, _), (d2, _) = waves(w, form="up0", **P)
        print("k=%g" % k, {q: float("%.5g" % v) for q, v in L.items()})
        print("   w/w_c=1e-4..1e6  branch1 c", c1.round(1), "branch2 c", c2.round(2)); print("   full Biot branch1", cb.round(1), "hf limits", biot_hf(P["M"], P["Q"], 1., 1670., 1000., .33).round(1))
        e = [c1[0] / L["c_u"] - 1, c1[-1] / np.sqrt(2 * L["D_hf"] * w[-1]) - 1, c2[0] / np.sqrt(2 * L["c_v"] * w[0]) - 1, c2[-1] / L["c_hf"] - 1, d2[-1] / L["c_d"] - 1, d1[-1] / np.sqrt(2 * P["Q"] * P["K"] * w[-1]) - 1, cb[-1] / biot_hf(P["M"], P["Q"], 1., 1670., 1000., .33)[0] - 1]
        print("   limit errors", ["%.1e" % x for x in e]); assert max(map(abs, e)) < 2e-2
    P = dict(M=2.2333e7, K=1e-4 / 9810, Q=5e8, alpha=.9, rho=1670.0, rho_f=1000.0); b = np.pi / 2
    t = np.linspace(0, .05, 11); U, V, Pp, lam = standing(t, b, 1.0, **P)
    def rhs(t, y):
        a = (-P["M"] * b * b * y[0] + P["alpha"] * b * y[2]) / P["rho"]
        return [y[1], a, P["Q"] * (-P["K"] * b * b * y[2] + P["K"] * P["rho_f"] * b * a - P["alpha"] * b * y[1])]
    s = solve_ivp(rhs, (0, .05), [0, 1, 0], t_eval=t, method="DOP853", rtol=1e-11, atol=1e-13)
    print("standing mode vs ODE: %.1e; eigenvalues*1s scaled %s" % (max(np.abs(s.y[0] - U).max() / np.abs(U).max(), np.abs(s.y[2] - Pp).max() / np.abs(Pp).max()), lam))
