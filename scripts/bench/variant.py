"""A way to solve the benchmark."""


class Variant:
    """`name` is QP solver/preconditioner, with /cascade behind if coarser levels give the start."""

    def __init__(self, name, levels, cascade, more=()):
        qp, preconditioner = name.split("/")[:2]
        self.name = name
        self.levels = levels
        self.options = ["--qp", qp, "--preconditioner", preconditioner, "--cascade", cascade, *more]

    def choose(self, levels):
        """Its own levels, or the wanted ones from its first on."""
        return self.levels if levels is None else [level for level in levels if level >= self.levels[0]]
