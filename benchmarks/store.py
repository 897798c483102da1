"""What a coverage store costs: time and bytes for each case, beside running it, and uniting and reading them.

`store.py [--cases N]`. The cases are those of a small campaign, over and over under other numbers.
"""

from __future__ import annotations

import argparse
import time
from itertools import cycle, islice
from pathlib import Path
from tempfile import TemporaryDirectory

from msgspec.structs import replace

from scbm.files import load_model
from scbm.store import ModelSource, StoredRun, combine_stores, drawn_recipe, read_history, write_store
from scbm.testing import RandomCases, Tester

MODEL = Path(__file__).parents[1] / "examples/robot_in_the_air/before.yaml"
DISTINCT = 100


def main() -> None:
    """Prints the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=20_000)
    count: int = parser.parse_args().cases
    model = load_model(MODEL)
    tester = Tester(model)
    begin = time.perf_counter()
    ran = [(case, tester.execute(case).result) for case in RandomCases(model).first(DISTINCT, 1)]
    running_s = (time.perf_counter() - begin) / DISTINCT
    with TemporaryDirectory() as name:
        stores = [Path(name) / "a.db", Path(name) / "b.db"]
        run = StoredRun(
            "0" * 32, "2026-11-21T12:00:00.000000Z", "scbm test", ModelSource(MODEL.name, MODEL.read_text())
        )
        begin = time.perf_counter()
        for seed, path in enumerate(stores):
            with write_store(path, model, replace(run, id=f"{seed:032}")) as writer:
                for number, (case, result) in enumerate(islice(cycle(ran), count // 2), start=1):
                    recipe = replace(drawn_recipe(case, ""), seed=seed, number=number)
                    writer.add(number, recipe, result)
        adding_s = (time.perf_counter() - begin) / count
        begin = time.perf_counter()
        combine_stores(stores, Path(name) / "all.db")
        uniting_s = (time.perf_counter() - begin) / count
        begin = time.perf_counter()
        history = read_history(Path(name) / "all.db")
        reading_s = (time.perf_counter() - begin) / count
        size = (Path(name) / "all.db").stat().st_size
    print(f"{len(history.cases)} cases")
    print(f"running a case    {running_s * 1e6:8.0f} us")
    print(
        f"adding it         {adding_s * 1e6:8.0f} us, {adding_s / running_s:.3f} of running it, in a transaction each"
    )
    print(f"uniting two       {uniting_s * 1e6:8.0f} us for each case")
    print(f"reading           {reading_s * 1e6:8.0f} us for each case")
    print(f"size              {size / count:8.0f} bytes for each case, {size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
