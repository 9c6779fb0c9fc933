#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Pages say what is there: relative links lead to files, docs/README.md lists every page, docs/equations.md names headers and names that
# exist, and its numbers and labels are those of the paper where the paper's source is at hand.
#   check_docs.sh ROOT [PAPER_TEX]
set -euo pipefail

cd "$1"
paper=${2:-}
status=0
complain() {
  echo "$1" >&2
  status=1
}

pages=(README.md CHANGELOG.md CONTRIBUTING.md)
while IFS= read -r page; do pages+=("$page"); done < <(find docs -name '*.md' | sort)

# Targets of the links of a page, one a line.
links_of() { { grep -oE '\]\([^) ]+\)' "$1" || true; } | sed -E 's/^\]\((.*)\)$/\1/'; }

check_links() {
  local page=$1 target
  while IFS= read -r target; do
    case $target in http://* | https://* | '#'*) continue ;; esac
    target=${target%%#*}
    [ -e "$(dirname "$page")/$target" ] || complain "$page: link to $target, which is not there"
  done < <(links_of "$page")
}
links=0
for page in "${pages[@]}"; do
  check_links "$page"
  links=$((links + $(links_of "$page" | wc -l)))
done
[ "$links" -gt 20 ] || complain "Only $links links found in all pages: the search is broken."

for page in "${pages[@]}"; do
  case $page in docs/README.md | [A-Z]*) continue ;; esac
  grep -qF "](${page#docs/})" docs/README.md || complain "docs/README.md does not list ${page#docs/}"
done

# Rows of the equations: | no. | label | `header`: `name`, `name`; `header`: ... | what differs |
numbers=0
while IFS='|' read -r _ number label where _; do
  header=""
  numbers=$((numbers + 1))
  [ "$((number))" -eq "$numbers" ] || complain "docs/equations.md: equation $number stands where $numbers is due"
  while IFS= read -r name; do
    if [[ $name == *.hpp ]]; then
      header=include/searvins/$name
      [ -e "$header" ] || complain "docs/equations.md, ($((number))): no header $name"
    elif [ -z "$header" ]; then
      complain "docs/equations.md, ($((number))): $name stands before a header"
    elif [ -e "$header" ] && ! grep -qw -- "$name" <(sed -E 's#//.*##' "$header"); then
      complain "docs/equations.md, ($((number))): $header has no $name"
    fi
  done < <({ grep -oE '`[^`]+`' <<<"$where" || true; } | tr -d '`')
  [ -n "$header" ] || complain "docs/equations.md, ($((number))): names no header"
done < <(grep -E '^\| *[0-9]+ *\|' docs/equations.md)
[ "$numbers" -ge 27 ] || complain "docs/equations.md has $numbers equations: the paper has 27"

# Numbers as LaTeX gives them: one an equation, one a line of align.
number_equations() {
  awk '
    /^[[:space:]]*%/ { next }
    /\\begin\{(equation|align)\}/ { kind = /align/ ? "align" : "equation"; n++; label = "none"; depth = 0; next }
    /\\end\{(equation|align)\}/ { print n, label; kind = ""; next }
    kind != "" {
      if (/\\begin\{(split|aligned|array|cases)\}/) depth++
      if (/\\end\{(split|aligned|array|cases)\}/) depth--
      if (match($0, /\\label\{[^}]*\}/)) label = substr($0, RSTART + 7, RLENGTH - 8)
      if (kind == "align" && depth == 0 && /\\\\[[:space:]]*$/) { print n, label; n++; label = "none" }
    }' "$1"
}
if [ -n "$paper" ] && [ -e "$paper" ]; then
  diff <(number_equations "$paper") \
    <(grep -E '^\| *[0-9]+ *\|' docs/equations.md | sed -E 's/^\| *([0-9]+) *\| *`?([^`| ]+).*/\1 \2/') >&2 ||
    complain "docs/equations.md: numbers and labels (right) are not the paper's (left)"
else
  echo "SKIPPED: numbers of docs/equations.md against the paper, whose source is not here"
fi

[ "$status" -ne 0 ] || echo "${#pages[@]} pages, $links links and $numbers equations hold."
exit "$status"
