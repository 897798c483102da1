# Steps that `.ci/run` and `.ci/full` share; they are sourced by both.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PIP_DISABLE_PIP_VERSION_CHECK=1 COLUMNS=120
unset SCBM_EXPLORE || true
cpu_times=$(mktemp)
trap 'rm -f "$cpu_times"' EXIT

step() { # begin a step; print how long the one before has taken
  end_step
  step_name=$*
  step_began_s=$SECONDS
  printf '\n== %s\n' "$step_name"
}

end_step() { # print the time of the present step, and the CPU time of all steps so far: of programs, of the system
  [ -n "${step_name:-}" ] || return 0
  times > "$cpu_times" # not in a pipe: that would be another shell, which has no times yet
  printf -- '-- %s: %d s; CPU so far: %s\n' "$step_name" $((SECONDS - step_began_s)) "$(tail -1 "$cpu_times")"
}

readme_command() { # the README's only line that creates the environment and matches a pattern
  local command
  command=$(sed -n "s/^\(python3 -m venv .*$1.*\)\$/\1/p" README.md)
  [ -n "$command" ] || { echo "the README lacks its command for $1" >&2; exit 1; }
  printf '%s\n' "$command"
}

install_tools() { # programs that some tests use, where apt may install them
  step "programs of others that tests use"
  local wanted=()
  command -v chromium > /dev/null || wanted+=(chromium fonts-dejavu-core)
  command -v genhtml > /dev/null || wanted+=(lcov)
  command -v idlc > /dev/null || wanted+=(cyclonedds-dev cyclonedds-tools)
  if [ ${#wanted[@]} -gt 0 ] && command -v apt-get > /dev/null && [ "$(id -u)" = 0 ]; then
    apt-get update -qq && apt-get install -y -qq --no-install-recommends "${wanted[@]}" > /dev/null || true
  fi
}

install_peers() { # packages that only the tests with programs of others use, where pip can install them
  step "extras that tests use: cluster, fast-downward"
  .venv/bin/pip install --quiet -e '.[cluster,fast-downward]' || true
}

require_tools() { # where all programs are installed, a test that cannot use one fails instead of being skipped
  if command -v chromium && command -v genhtml && command -v idlc && command -v cc \
    && .venv/bin/python -c 'import distributed, up_fast_downward' 2> /dev/null; then
    export SCBM_ALL_TOOLS=1
  fi
}

readme_tests() {
  step "a fresh environment, and the README's command for the tests in it"
  rm -rf .venv
  local command
  command=$(readme_command pytest)
  echo "$command"
  time eval "$command"
}

install_developer_tools() {
  step "the tools for developers"
  .venv/bin/pip install --quiet -e '.[dev]'
}

pictures_in_other_pythons() { # where they are installed; pictures are compared byte by byte with those of Python 3.11
  local version python folder
  for version in 3.12 3.13; do
    step "pictures, drawn by Python $version"
    python=$( (compgen -c "python$version"; compgen -G "$HOME/.pyenv/versions/$version*/bin/python") | while read -r each; do
      if "$each" -c '' 2> /dev/null; then echo "$each"; break; fi  # a shim of pyenv may be there without its Python
    done) || true
    [ -n "$python" ] || { echo "Python $version is not installed"; continue; }
    folder=$(mktemp -d)
    "$python" -m venv "$folder" && "$folder/bin/pip" install --quiet -e '.[testing,draw]' pytest-xdist
    "$folder/bin/python" -m pytest -n 0 tests/unit/drawing
    rm -rf "$folder"
  done
}

static_checks() {
  step "lint and format"
  .venv/bin/ruff check .
  .venv/bin/ruff format --check .
  step "types"
  .venv/bin/mypy
  step "layers"
  .venv/bin/lint-imports
  step "documentation site"
  local site
  site=$(mktemp -d)
  .venv/bin/sphinx-build -q -W -b html docs "$site"
  rm -rf "$site"
}

source_mutants() {
  step "mutants of the source, which tests must notice"
  .venv/bin/python tests/source_mutants/source_mutants.py "$@"
}

examples() {
  step "examples"
  for model in examples/*/*.yaml; do .venv/bin/scbm check --strict "$model"; done
  .venv/bin/scbm test examples/robot_in_the_air/after.yaml examples/robot_in_the_air/cases --fail-under 100
  .venv/bin/scbm test examples/dual_cnc/cell.yaml examples/dual_cnc/cases
  .venv/bin/scbm test examples/dual_cnc/cell.yaml --cases 200 --seed 1 --inputs drawn

  step "the README's command for the campaign, from a clean copy"
  local copy
  copy=$(mktemp -d)
  git archive HEAD | tar -x -C "$copy"
  (cd "$copy" && eval "$(cd "$OLDPWD" && readme_command 'scbm test')")
  rm -rf "$copy"

  step "every obligation of the examples decided, and the proofs checked"
  local closed
  closed=$(mktemp -d)
  .venv/bin/scbm close examples/robot_in_the_air/before.yaml --out "$closed/before"
  .venv/bin/scbm close --check "$closed"/before/certificates/*
  .venv/bin/scbm close examples/robot_in_the_air/after.yaml --out "$closed/after"
  .venv/bin/scbm test examples/robot_in_the_air/after.yaml "$closed/after" --fail-under 100
  .venv/bin/scbm close examples/dual_cnc/cell.yaml --out "$closed/dual_cnc"
  .venv/bin/scbm test examples/dual_cnc/cell.yaml "$closed/dual_cnc" --certificates "$closed/dual_cnc" --fail-under coverable=100
  rm -rf "$closed"

  step "reports of the example, from two stores"
  local reports
  reports=$(mktemp -d)
  .venv/bin/scbm test examples/robot_in_the_air/before.yaml --cases 20 --seed 1 --store "$reports/cov.db"
  .venv/bin/scbm test examples/robot_in_the_air/before.yaml --cases 20 --seed 2 --store "$reports/cov2.db"
  .venv/bin/scbm combine "$reports/cov.db" "$reports/cov2.db" -o "$reports/all.db"
  .venv/bin/scbm report "$reports/all.db" --html "$reports/report.html" --junit "$reports/j.xml" \
    --cobertura "$reports/c.xml" --lcov "$reports/l.info" --sarif "$reports/s.json" --markdown "$reports/m.md"
  ls -l "$reports"
  rm -rf "$reports"

  step "the example over nodes, as processes"
  .venv/bin/scbm test examples/robot_in_the_air/after.yaml --cases 5 --seed 1 --transport dds --time-scale 20 --wait '2 min'
}

new_project() {
  step "a new project, from the package as users install it"
  local made
  made=$(mktemp -d)
  .venv/bin/pip wheel --quiet --no-deps --wheel-dir "$made" .
  python3 -m venv "$made/.venv"
  "$made/.venv/bin/pip" install --quiet "$made"/*.whl pytest # as the CI job of a new project does
  (cd "$made" && .venv/bin/scbm init cell --example paper && cd cell && ../.venv/bin/scbm check --strict model.yaml \
    && ../.venv/bin/scbm test model.yaml cases --fail-under 100 && ../.venv/bin/pytest -q)
  rm -rf "$made"
}
