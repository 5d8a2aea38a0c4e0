:- use_module(library(plunit)).
:- use_module(library(assoc)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).

known :-
    load_facts([ kind(p, cup, 'Thing'), kind(p, jug, 'Thing'), kind(p, cup, 'Clay'),
                 value(p, near, cup, jug), value(p, near, cup, pot), fluent(p, full, cup, true),
                 effect(p, 'Pour'(X, Y), fluent(full, X), false), effect(p, 'Pour'(X, Y), fluent(full, Y), true) ], _).

forgotten :- drop_facts(p, _).

initially(S) :- situation(p, plan(t), 2, 1000, S).

:- begin_tests(situations, [setup(known), cleanup(forgotten)]).

test('at first, what the knowledge base says holds', Vs == [jug, pot]) :-
    initially(S), findall(V, fluent_value(near, cup, V, S), Vs).
test('subjects are found by value', Xs == [cup]) :-
    initially(S), findall(X, fluent_value(full, X, true, S), Xs).
test('an effect takes the place of what held', Vs == [[false], [true]]) :-
    initially(S0), apply_effects('Pour'(cup, jug), S0, S),
    findall(V, fluent_value(full, cup, V, S), Cup), findall(V, fluent_value(full, jug, V, S), Jug),
    Vs = [Cup, Jug].
test('after an effect, subjects are found by their values of now', Xs == [jug]) :-
    initially(S0), apply_effects('Pour'(cup, jug), S0, S), findall(X, fluent_value(full, X, true, S), Xs).
test('effects are told in the log', Log == [told(full, cup, false), told(full, jug, true)]) :-
    initially(S0), apply_effects('Pour'(cup, jug), S0, S), take_log(S, Log, _).
test('doing the same again does not make the situation larger', Before == After) :-
    initially(S0), apply_effects('Pour'(cup, jug), S0, S1), take_log(S1, _, S2), term_size(S2, Before),
    apply_effects('Pour'(cup, jug), S2, S3), take_log(S3, _, S4), term_size(S4, After).
test('what is forgotten is as the knowledge base says', Vs == [true]) :-
    initially(S0), apply_effects('Pour'(cup, jug), S0, S1), forget(full, cup, S1, S),
    findall(V, fluent_value(full, cup, V, S), Vs).

test('individuals come in order of name', Xs == [cup, jug]) :-
    initially(S), findall(X, member_of('Thing', X, S), Xs).
test('an individual is of its classes only') :-
    initially(S), member_of('Clay', cup, S), \+ member_of('Clay', jug, S).

test('situations with the same future have the same key, however they came about', Same == true) :-
    initially(S0), apply_effects('Pour'(cup, jug), S0, S1), take_log(S1, _, S2), progressed(S1, K1), progressed(S2, K2),
    ( K1 == K2 -> Same = true ; Same = K1-K2 ).

:- end_tests(situations).
