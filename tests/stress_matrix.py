"""What tests/stress.py varies: one setting at a time around two scenes, some pairs, and samples at random."""
import itertools
import random

SCENES = ("load", "impact")

# What a setting is in the parameter file.
KEYS = {
    "basis": "Explicit MPM/Basis", "transfer": "Explicit MPM/Transfer", "steps": "Scheme",
    "step factor": "Explicit MPM/Step factor", "tolerance": "Implicit solver/Step tolerance",
    "time step": "Implicit solver/Time step", "points": "Bodies/ground/Points per cell",
    "points of the block": "Bodies/block/Points per cell",
}

SCHEMES = {
    "gimp": {}, "q1": {"basis": "q1"}, "gimp flip": {"transfer": "flip"}, "q1 flip": {"basis": "q1", "transfer": "flip"},
    "gimp pic": {"transfer": "pic"},
    "gimp semi-implicit": {"steps": "semi-implicit"}, "q1 semi-implicit": {"basis": "q1", "steps": "semi-implicit"},
    "gimp implicit": {"steps": "implicit"}, "q1 implicit": {"basis": "q1", "steps": "implicit"},
}
SCHEMES_OF = {"load": ("gimp", "q1", "gimp flip", "gimp pic", "gimp semi-implicit", "q1 semi-implicit", "gimp implicit",
                       "q1 implicit"),
              "impact": ("gimp", "q1", "gimp flip", "gimp semi-implicit", "gimp implicit")}
REFUSED = {"impact": ("gimp implicit",)}  # once is enough

AXES = {
    "k": (1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-3, 1e-2, 1e-1),
    "nu": (0.0, 0.2, 0.4, 0.45, 0.49, 0.499, 0.4999),
    "n": (0.05, 0.2, 0.6, 0.8, 0.9),
    "K_f": (1e5, 1e6, 1e7, 1e8, 1e9),
    "points": (1, 3, 4, 5),
    "fill": (0.01, 0.02, 0.05, 0.1, 0.25, 0.37, 0.5, 0.75, 0.9, 0.99),
    "aspect": (0.1, 0.2, 0.5, 2, 5, 10),
    "step factor": (0.1, 0.3, 0.5, 0.95),
}
AXES_OF = {
    "load": dict(AXES, slope=(0.37, 1, 2.6), law=("hencky", "neo-hookean", "jaumann")),
    "impact": dict(AXES, v=(0.1, 3, 10, 30, 100, 200), ratio=(1e-3, 1e-2, 1e-1, 1, 10, 1e3, 1e4, 1e5), shift=(0, 0.5, 0.9),
                   law=("hencky", "neo-hookean", "jaumann")),
}
IMPLICIT_AXES = {"tolerance": (1e-1, 1e-2, 1e-4), "time step": ("End/4", "End/40", "End/400")}
PAIRS_OF = {
    "load": (("fill", (0.01, 0.05, 0.37), "k", (1e-12, 1e-3, 1e-1)), ("fill", (0.01, 0.37), "points", (1, 3, 5)),
             ("nu", (0.499, 0.4999), "k", (1e-12, 1e-6)), ("n", (0.05, 0.9), "K_f", (1e6, 1e8)),
             ("aspect", (0.1, 10), "k", (1e-12, 1e-2)), ("step factor", (0.95,), "fill", (0.01, 0.05, 0.5)),
             ("aspect", (0.1, 10), "fill", (0.01, 0.37)), ("step factor", (0.95,), "k", (1e-2,))),
    "impact": (("v", (0.1, 10, 200), "ratio", (1e-3, 1, 1e5)), ("v", (10, 200), "fill", (0.01, 0.37)),
               ("v", (10, 200), "k", (1e-12, 1e-2)), ("ratio", (1e-3, 1e5), "fill", (0.01, 0.37)),
               ("step factor", (0.95,), "ratio", (1e-3, 1e5))),
}
PAIR_SCHEMES = {"load": ("gimp", "q1", "gimp implicit"), "impact": ("gimp", "q1")}
MOST_MARGIN = 2.0
MOST_STEPS = 5000  # of runs whose step the diffusion of pressure limits
TOO_LARGE = (1.2, 1.5, 2.0, 3.0)  # above 2, all blow up: the limit has a margin where no material reaches over a face


class Case:
    """A run: scene, settings, and whether its step is above the limit: then it ends sound or blows up and is caught."""

    def __init__(self, scene, group, settings, too_large=False):
        self.scene, self.group, self.too_large = scene, group, too_large
        self.settings = dict(settings)

    @property
    def must_blow_up(self):
        return self.too_large and self.settings["step factor"] > MOST_MARGIN

    @property
    def name(self):
        return self.scene + ": " + (", ".join("%s = %s" % item for item in self.settings.items()) or "base")

    def words(self):
        """--set options of the run."""
        settings = {"transits": 24 if self.scene == "load" else 6}
        settings.update(self.settings)
        settings.pop("law", None)
        # Steps of the skeleton's wave are some ten times longer; what blows up needs steps to do so. What a fast impact
        # throws up is at the upper edge of the mesh by then.
        if "steps" in settings and settings.get("v", 0) < 100:
            settings["transits"] *= 8
        if self.too_large:
            settings["transits"] *= 10
        if "steps" not in settings:
            settings["transits"] *= min(1.0, MOST_STEPS / self.diffusive_steps(settings["transits"]))
        words = []
        for key, value in settings.items():
            words += ["--set", "%s=%s" % (KEYS.get(key, "Constants/" + key), value)]
            if key == "points" and self.scene == "impact":
                words += ["--set", "%s=%s" % (KEYS["points of the block"], value)]
        return words

    def diffusive_steps(self, transits):
        """Steps that the diffusion of pressure asks for, from the constants of the scenes."""
        value = lambda key, usual: self.settings.get(key, usual)
        height, cells = (1.2, 12) if self.scene == "load" else (1.0, 10)
        h = height / (cells - 1 + value("fill", 1)) * min(1, value("aspect", 1))
        storage = value("K_f", 2.2e9) / value("n", 0.4)
        diffusivity = storage * value("k", 1e-4) / 9810
        c_u = (storage / 2000)**0.5
        return max(1.0, transits * height / c_u * 2 * diffusivity / (0.5 * h**2))


def axes_of(scene, scheme):
    """What is varied: implicit steps follow from their error, or are given, and know no limit."""
    axes = dict(AXES_OF[scene])
    if SCHEMES[scheme].get("steps") == "implicit":
        del axes["step factor"]
        axes.update(IMPLICIT_AXES)
    return axes


def one_at_a_time():
    for scene in SCENES:
        for scheme in SCHEMES_OF[scene]:
            yield Case(scene, scheme + ", base", SCHEMES[scheme])
            if scheme in REFUSED.get(scene, ()):
                continue
            for key, values in axes_of(scene, scheme).items():
                for value in values:
                    yield Case(scene, "%s, %s" % (scheme, key), dict(SCHEMES[scheme], **{key: value}))


def pairs():
    for scene in SCENES:
        for scheme in PAIR_SCHEMES[scene]:
            for first, firsts, second, seconds in PAIRS_OF[scene]:
                if not {first, second} <= set(axes_of(scene, scheme)):
                    continue
                for a, b in itertools.product(firsts, seconds):
                    yield Case(scene, "%s, %s and %s" % (scheme, first, second),
                               dict(SCHEMES[scheme], **{first: a, second: b}))


def above_the_limit():
    scenes = (("load", {}), ("load", {"k": 1e-1}), ("load", {"fill": 0.05}), ("impact", {"v": 0.1}))
    for (scene, settings), scheme, factor in itertools.product(scenes, ("gimp", "q1", "gimp semi-implicit"), TOO_LARGE):
        yield Case(scene, "%s, above the limit" % scheme, dict(SCHEMES[scheme], **settings, **{"step factor": factor}), True)


def at_random(n, seed):
    """So many of each scene; logarithmic where the range spans decades."""
    generator = random.Random(seed)
    log = lambda low, high: float("%.3g" % (low * (high / low)**generator.random()))
    linear = lambda low, high: float("%.3g" % generator.uniform(low, high))
    for scene in SCENES:
        for _ in range(n):
            scheme = generator.choice([name for name in SCHEMES_OF[scene] if scene == "load" or "implicit" not in name])
            settings = dict(SCHEMES[scheme])
            settings.update({"k": log(1e-12, 1e-1), "nu": generator.choice((linear(0, 0.45), float("%.4g" % (0.5 - log(1e-4, 0.05))))),
                             "n": linear(0.05, 0.9), "K_f": log(1e5, 2.2e9), "points": generator.randint(1, 5),
                             "fill": generator.choice((1, log(0.01, 1))), "aspect": generator.choice((1, log(0.1, 10))),
                             "step factor": linear(0.1, 0.95)})
            if "step factor" not in axes_of(scene, scheme):
                del settings["step factor"]
            if scene == "impact":
                settings.update({"v": log(0.1, 200), "ratio": log(1e-3, 1e5), "shift": linear(0, 1)})
            yield Case(scene, "at random", settings)


def all_cases(n_random=120, seed=1):
    return list(one_at_a_time()) + list(pairs()) + list(above_the_limit()) + list(at_random(n_random, seed))


def some_of(cases, share):
    """One case of so many in each group, at least one: what every group has, in a fraction of the time."""
    places = {}
    for case in cases:
        places.setdefault((case.scene, case.group), []).append(case)
    # Groups begin at different places, so that not all of them have their smallest value.
    return [case for number, group in enumerate(places.values()) for case in group[number % min(share, len(group))::share]]


def few_cases():
    """A small sample of all kinds for the quick tests: those that the matrix found sound."""
    base = [("load", {}), ("load", {"fill": 0.01}), ("load", {"nu": 0.499, "k": 1e-6}), ("load", {"steps": "semi-implicit", "k": 1e-2}),
            ("load", {"steps": "implicit", "fill": 0.01}), ("load", {"basis": "q1", "aspect": 5}), ("load", {"K_f": 1e5}),
            ("load", {"steps": "implicit", "transfer": "pic"}), ("impact", {}), ("impact", {"ratio": 1e3}),
            ("impact", {"steps": "semi-implicit"}), ("impact", {"steps": "implicit"})]
    cases = [Case(scene, "sample", settings) for scene, settings in base]
    return cases + [Case("load", "sample", {"step factor": 2.0}, True)]
