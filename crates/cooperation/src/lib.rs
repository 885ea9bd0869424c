//! Symmetry position/force hybrid control of one object by n arms (Wu, Ogawa, Konno 2016, sections 2 and 3).
