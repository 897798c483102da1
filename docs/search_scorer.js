// How the search of the site ranks its results; all values but `score` are those of Sphinx.
var Scorer = {
  // Guides stand above other pages, the API and the list of modules below them, and decisions, for those who change scbm, last.
  score: ([page, , , , score]) =>
    score +
    (/^(tutorial|how-to)\//.test(page) ? 20 : 0) -
    (/^(reference\/api\/|explanation\/modules)/.test(page) ? 20 : 0) -
    (/^decisions\//.test(page) ? 1000 : 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
