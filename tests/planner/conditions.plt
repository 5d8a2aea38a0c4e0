:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(conditions)).
:- use_module(planner_golog(projection)).

known :-
    load_facts([ kind(c, cup, 'Thing'), kind(c, jug, 'Thing'), kind(c, pot, 'Thing'), kind(c, cup, 'Clay'), kind(c, pot, 'Clay'),
                 value(c, near, cup, jug), value(c, near, cup, pot), fluent(c, full, cup, true), value(c, height, jug, 3),
                 value(c, height, pot, 1), value(c, height, pot, 5), value(c, weight, jug, 1.0e308),
                 effect(c, 'Pour'(X, Y), fluent(full, X), false), effect(c, 'Pour'(X, Y), fluent(full, Y), true) ], _).

forgotten :- drop_facts(c, _).

initially(S) :- situation(c, plan(t), 2, 1000, S).

yes(C) :- initially(S), asked(C, S, yes).
no(C) :- initially(S), asked(C, S, no).

:- begin_tests(conditions, [setup(known), cleanup(forgotten)]).

test('all of nothing holds, any of nothing does not') :-
    initially(S), once(holds(all([]), S)), \+ holds(any([]), S).
test('all shares its variables', Xs == [cup]) :-
    initially(S), findall(X, holds(all([holds(near, X, jug), holds(full, X, true)]), S), Xs).
test('what is not known does not hold') :-
    initially(S), once(holds(not(holds(full, jug, true)), S)), \+ holds(holds(full, jug, true), S).
test('numbers compare, as far as they are known') :-
    initially(S), once(holds(compare(at_least, value(height, jug), 3), S)), once(holds(compare(less, 1.5, value(height, jug)), S)),
    \+ holds(compare(more, value(height, jug), 3), S), \+ holds(compare(at_most, value(height, cup), 99), S),
    \+ holds(compare(equal, value(near, cup), value(near, cup)), S).
test('what only acting finds out is asked for in vain', Answers == [yes, no, unknown(loc(f, seen))]) :-
    initially(S), findall(A, ( member(C, [holds(full, cup, true), holds(full, cup, false), is_true(loc(f, seen))]), asked(C, S, A) ), Answers).

test('some: there is an individual of which all parts hold') :-
    yes(some([X-'Clay'], holds(near, cup, X))), yes(some([X-'Thing', Y-'Thing'], all([holds(near, X, Y), holds(full, X, true)]))),
    no(some([X-'Clay'], all([holds(near, cup, X), holds(height, X, 3)]))).
test('some: the parts may come in any order') :-
    forall(permutation([holds(near, cup, X), not(is_a(X, 'Clay')), compare(more, value(height, X), 2)], Cs),
           yes(some([X-'Thing'], all(Cs)))).
test('some: not is about the individuals that are taken') :-
    yes(some([X-'Thing'], not(holds(full, X, true)))), no(some([X-'Thing'], all([holds(full, X, true), not(holds(near, X, jug))]))).
test('some: a variable without a class is what a property has') :-
    yes(some([X, H], all([holds(near, cup, X), holds(height, X, H), compare(less, H, 2)]))),
    no(some([X, H], all([holds(near, cup, X), holds(height, X, H), compare(less, H, 1)]))),
    yes(some([X], all([holds(near, X, pot), is_a(X, 'Clay')]))).
test('some: one value has to do for all parts') :-
    yes(some([H], all([holds(height, pot, H), compare(more, H, 4)]))),
    no(some([H], all([holds(height, pot, H), compare(more, H, 1), compare(less, H, 5)]))).
test('some within not, and within some') :-
    yes(not(some([X-'Clay'], holds(near, X, cup)))), no(not(some([X-'Clay'], holds(near, X, pot)))),
    yes(some([X-'Thing'], not(some([Y-'Thing'], holds(near, X, Y))))),
    no(some([X-'Thing'], all([holds(full, X, true), not(some([Y-'Clay'], holds(near, X, Y)))]))).
test('some follows what actions change') :-
    initially(S0), apply_effects('Pour'(cup, jug), S0, S),
    C = some([X-'Thing'], all([holds(near, cup, X), holds(full, X, true)])),
    asked(C, S0, no), asked(C, S, yes).
test('some gives nothing a value outside', Xs == [cup]) :-
    initially(S), findall(X, satisfies([X-'Thing'], some([Y-'Clay'], holds(near, X, Y)), S), Xs).
test('what only acting finds out is asked last', Answers == [no, unknown(loc(f, seen))]) :-
    initially(S),
    findall(A, ( member(V, [false, true]), asked(some([X-'Thing'], all([is_true(loc(f, seen)), holds(full, X, V)])), S, A) ), Answers).
test('individuals of which not all holds', Xs == [jug, pot]) :-
    initially(S), findall(X, satisfies([X-'Thing'], not(holds(full, X, true)), S), Xs).
test('two things are one or not') :-
    yes(same(cup, cup)), no(same(cup, jug)), no(same(1, 1.0)), yes(some([X-'Thing'], all([holds(near, cup, X), not(same(X, jug))]))).
test('sums compare, as far as they are numbers') :-
    yes(compare(equal, plus(value(height, jug), times(2, 1.5)), 6)), yes(compare(less, minus(1, value(height, jug)), -1)),
    no(compare(equal, plus(value(near, cup), 1), plus(value(near, cup), 1))),
    no(compare(more, times(value(weight, jug), 10), 0)), no(compare(at_most, times(value(weight, jug), 10), 0)).
test('a condition is closed if it has no variable but those of some') :-
    closed(some([X-'Thing', Y], all([holds(near, X, Y), not(same(X, Y))]))), closed(any([])),
    \+ closed(some([X-'Thing'], holds(near, X, _))), \+ closed(all([some([Z-'Thing'], is_a(Z, 'Clay')), holds(full, Z, true)])).

:- end_tests(conditions).
