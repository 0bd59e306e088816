//! Nothing: the tests are below `tests/`, what they share with the evaluation is the crate `trials`.
