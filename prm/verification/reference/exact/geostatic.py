"""Geostatic initial state of a saturated, laterally confined layer (exact), water table at or above the surface.

depth d = H - z; p = rho_f g (d + hw) (hw: free water above the surface, which also loads the surface by rho_f g hw)
total vertical  s_zz = -(rho g d + rho_f g hw); Biot's effective stress s''_zz = s_zz + alpha p
horizontal: s''_xx = K0 s''_zz, K0 = nu/(1-nu) for elastic gravity loading; s_xx = s''_xx - alpha p.
displacement of elastic gravity loading (hw=0): u = -(rho - alpha rho_f) g (H z - z^2/2)/M.
In the static state R_i = -p_,i + rho_f g_i = 0 exactly: a numerical scheme must keep p_dot = 0 and u = 0 for all time
(start from this state and run: what moves is the scheme's own imbalance; also with the grid moved by a fraction of h).
Seepage: steady upward flow with head loss i: p = rho_f g (1+i) d; s'' vanishes at i_c = (rho - rho_f)/rho_f (alpha=1).
"""
import numpy as np


def state(z, H, rho, rho_f, g, nu, alpha=1.0, hw=0.0, K0=None, i=0.0):
    z = np.asarray(z, float); d = H - z
    K0 = nu / (1 - nu) if K0 is None else K0
    p = rho_f * g * (d * (1 + i) + hw)
    szz = -(rho * g * d + rho_f * g * hw)
    ezz = szz + alpha * p
    exx = K0 * ezz
    return p, szz, ezz, exx - alpha * p, exx


def displacement(z, H, M, rho, rho_f, g, alpha=1.0):
    z = np.asarray(z, float)
    return -(rho - alpha * rho_f) * g * (H * z - z**2 / 2) / M


if __name__ == "__main__":
    import terzaghi
    H, E, nu, rho, rf, g, al = 10., 1e7, .3, 1900., 1000., 9.81, 1.0
    M = E * (1 - nu) / ((1 + nu) * (1 - 2 * nu)); lam = E * nu / ((1 + nu) * (1 - 2 * nu))
    z = np.linspace(0, H, 5); p, s, e, sx, ex = state(z, H, rho, rf, g, nu)
    h = 1e-4; u = lambda z: displacement(z, H, M, rho, rf, g)
    ez = (u(z + h) - u(z - h)) / (2 * h)
    print("s''zz from strain: %.1e ; s''xx %.1e; p Terzaghi self-weight long time %.1e ; u %.1e" % (
        np.abs(M * ez - e).max() / abs(e[0]), np.abs(lam * ez - ex).max() / abs(e[0]),
        np.abs(terzaghi.selfweight(z, 1e9, H, 1e-8, M, rho, rf, g)[0] - p).max() / p[0],
        np.abs(terzaghi.selfweight(z, 1e9, H, 1e-8, M, rho, rf, g)[1] - u(z)).max() / abs(u(H))))
    print("critical gradient: effective stress at base with i=%.3f: %.2e" % ((rho - rf) / rf, state(np.array([0.]), H, rho, rf, g, nu, i=(rho - rf) / rf)[2][0]))
