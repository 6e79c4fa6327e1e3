"""python3 -m experiments.lab NAME: runs a benchmark and prints its table."""

import argparse
import pathlib
import sys

from . import benchmark, corpus

ROOT = pathlib.Path(__file__).resolve().parents[2]


def main():
    parser = argparse.ArgumentParser(prog="python3 -m experiments.lab", description="Runs a benchmark, prints its table.")
    parser.add_argument("experiment", help="name in experiments/lab/questions, or a TOML file")
    parser.add_argument("--out", type=pathlib.Path, help="directory of the rows (default: results/local/EXPERIMENT)")
    parser.add_argument("--hermesh", default=str(ROOT / "build/release/hermesh"), help="the program that validates")
    parser.add_argument("--program", action="append", default=[], metavar="NAME=FILE",
                        help="also run this program with the first method's arguments, such as another version of it")
    parser.add_argument("--models", type=int, help="size of the sample instead of the experiment's")
    arguments = parser.parse_args()
    file = pathlib.Path(arguments.experiment)
    if not file.suffix:
        file = ROOT / "experiments/lab/questions" / f"{arguments.experiment}.toml"
    say = lambda text: print(text, file=sys.stderr, flush=True)
    try:
        experiment = benchmark.read_experiment(file)
        for program in arguments.program:
            name, _, path = program.partition("=")
            request = [path if word == "{hermesh}" else word for word in experiment["method"][0]["request"]]
            experiment["method"].append({"name": name, "request": request})
        entries = corpus.read_corpus(ROOT / "experiments/data" / experiment["corpus"])
        entries = corpus.sample(entries, arguments.models or experiment["models"], experiment["seed"])
        cache = corpus.cache_directory()
        corpus.fetch(entries, cache, say)
        run = benchmark.Benchmark(experiment, arguments.hermesh, arguments.out or ROOT / "results/local" / file.stem, say)
        rows = run.run(entries, cache)
        print(benchmark.table(rows, [m["name"] for m in experiment["method"]]))
    except (benchmark.ExperimentError, corpus.CorpusError, OSError) as error:
        sys.exit(f"error: {error}")
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
