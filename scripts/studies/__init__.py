"""The recorded studies.

One module each. `arguments(parser)` and `run(arguments)` measure, and return an exit code. `pages()` gives every file that is made
of the records, with its text; `used()` the records in bench-results/raw/NAME that these draw from, where there are any.
"""

from . import accuracy, adaptive, hard, kernels, model, peers, precision, scaling, study, tables, verification

STUDIES = {
    module.__name__.rpartition(".")[2]: module
    for module in (tables, hard, precision, adaptive, peers, accuracy, verification, scaling, study, model, kernels)
}
