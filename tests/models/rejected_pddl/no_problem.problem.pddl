(problem one-crate)
