// How the search of the site ranks its results; all values but `score` are those of Sphinx.
var Scorer = {
  // Decisions are for those who change scbm: below tutorials, how-to guides, reference and explanations.
  score: ([page, , , , score]) => (page.startsWith("decisions/") ? score - 1000 : score),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
