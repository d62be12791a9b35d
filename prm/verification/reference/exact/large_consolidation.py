"""Finite-strain 1D consolidation, weightless, quasi-static (semi-exact: tight method of lines; exact end states).

Reference coordinate 0<=Z<=H (base impermeable, fixed), J = stretch, nominal effective law P(J) (column_selfweight.nominal),
alpha=1, spatial mobility K=k/gamma_f constant, spatial Q constant (np.inf: Gibson-type incompressible):
   p = q + P(J)                         (equilibrium, quasi-static)
   J_t (1 + J P'(J)/Q) = d/dZ [ (K/J) P'(J) dJ/dZ ]      (seed (2b) in the current configuration: p_t/Q = -(w_z + v_z))
   top: P(J) = -q (p=0);  base: J_Z = 0;  t=0: J = 1, p = q (`undrained`: as a sudden load leaves it, p0 = -Q ln J0 = q + P(J0))
   settlement = int (1-J) dZ ; final: J_inf = P^{-1}(-q) uniform.   Early time: similarity in Z'/sqrt(t).
Small q: Terzaghi with c_v = K M.
"""
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from column_selfweight import nominal, stretch


def dP(J, law, M, mu=None):
    if law == "hencky":
        return M * (1 - np.log(J)) / J**2
    if law == "neohooke":
        la = M - 2 * mu
        return mu * (1 + 1 / J**2) + la * (1 - np.log(J)) / J**2
    if law == "jaumann":
        return M / J
    if law == "small":
        return M + 0 * J
    raise ValueError(law)


def solve(t, q, H, K, M, law="hencky", mu=None, Q=np.inf, n=600, rtol=1e-8, undrained=False):
    """t increasing array. returns Zc, J[t,n], p[t,n], settlement[t]. Finite volumes, mesh graded to the drained top."""
    s = np.linspace(0, 1, n + 1)
    g = 4.0
    Ze = H * np.tanh(g * s) / np.tanh(g)
    Zc = 0.5 * (Ze[1:] + Ze[:-1]); dZ = np.diff(Ze)
    Jt = stretch(np.array([-q]), law, M, mu)[0]
    J0 = 1.0 if np.isinf(Q) or not undrained else brentq(lambda J: -Q * np.log(J) - q - nominal(J, law, M, mu), Jt, 1.0)
    iq = 0.0 if np.isinf(Q) else 1 / Q
    # flux in the variable Phi = int K P'(J)/J dJ ~ evaluated by face averages
    D = lambda J: K * dP(J, law, M, mu) / J
    def rhs(tt, J):
        f = np.zeros(n + 1)
        f[1:-1] = D(0.5 * (J[1:] + J[:-1])) * (J[1:] - J[:-1]) / (Zc[1:] - Zc[:-1])
        f[-1] = D(0.5 * (J[-1] + Jt)) * (Jt - J[-1]) / (Ze[-1] - Zc[-1])
        return (f[1:] - f[:-1]) / dZ / (1 + J * dP(J, law, M, mu) * iq)
    t = np.atleast_1d(np.asarray(t, float))
    sol = solve_ivp(rhs, (0, t[-1]), np.full(n, J0), t_eval=t, method="LSODA", lband=1, uband=1, rtol=rtol, atol=1e-11)
    J = sol.y.T
    return Zc, J, q + nominal(J, law, M, mu), (1 - J) @ dZ


if __name__ == "__main__":
    from scipy.integrate import solve_bvp
    import terzaghi
    H, K, M = 1.0, 1e-9, 1e6
    cv = K * M
    T = np.array([0.01, 0.1, 0.3, 1.0]) * H**2 / cv
    z, J, p, s = solve(T, 1e3, H, K, M)
    st = terzaghi.settlement(T, 1e3, H, K, M)
    print("small load vs Terzaghi settlement: %s" % (s / st - 1))
    q = 0.4 * M
    r = [solve(T, q, H, K, M, "hencky", n=n)[3] for n in (150, 300, 600)]
    print("q=0.4M: settlement", r[2], "self-convergence", np.abs(r[1] - r[0]).max(), np.abs(r[2] - r[1]).max())
    Jf = stretch(np.array([-q]), "hencky", M)[0]
    print("final settlement %.8f exact %.8f" % (solve([20 * H**2 / cv], q, H, K, M)[3][-1], (1 - Jf) * H))
    # independent early-time similarity: -eta/2 J' = (D J')', eta = y/sqrt(t), y distance from the top
    D = lambda J: K * dP(J, "hencky", M) / J
    dD = lambda J: (D(J + 1e-7) - D(J - 1e-7)) / 2e-7
    L = 12 * np.sqrt(cv)
    b = solve_bvp(lambda x, y: np.vstack([y[1] / D(y[0]), -x / 2 * y[1] / D(y[0])]), lambda a, c: np.array([a[0] - Jf, c[0] - 1]), np.linspace(0, L, 200), np.vstack([np.linspace(Jf, 1, 200), np.full(200, cv * (1 - Jf) / L)]), tol=1e-9, max_nodes=20000)
    x = np.linspace(0, L, 20001); sim = np.trapz(1 - b.sol(x)[0], x) * np.sqrt(T[0])
    print("early time: settlement %.6e similarity %.6e" % (r[2][0], sim)); assert abs(r[2][0] / sim - 1) < 1e-3
    s1 = solve(T, q, H, K, M, "hencky", Q=1e3 * M)[3]; print("effect of Q=1000 M on settlement: %s" % (s1 / r[2] - 1))
