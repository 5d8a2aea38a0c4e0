:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(hypotheses)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(sessions)).
:- use_module(planner_golog(travel)).

% r1 reaches p1, and p2 from there; r2 reaches nothing. Lift needs a lifter, and a box that is light enough.

hall :-
    load_facts(
        [ kind(h, r1, 'Robot'), kind(h, r2, 'Robot'), kind(h, r2, 'Lifter'), kind(h, door, 'Door'),
          value(h, payload, r1, 2), value(h, weight, box, 3), fluent(h, open, door, false),
          value(h, energy_J, r1, 50), value(h, power_W, r1, 1000),
          agent(h, 'Go'(R1, _), R1), duration(h, 'Go'(R2, X2), travel(R2, X2, 10)),
          agent(h, 'Work'(R3), R3), duration(h, 'Work'(_), fixed(60)),
          agent(h, 'Lift'(R4, _), R4), duration(h, 'Lift'(_, _), fixed(5)), requires(h, 'Lift', 'Lifter'),
          precondition(h, 'Lift'(R5, B5), compare(at_least, value(payload, R5), value(weight, B5))),
          agent(h, 'Pass'(R6), R6), duration(h, 'Pass'(_), fixed(5)), claims(h, 'Pass'(_), door),
          precondition(h, 'Pass'(_), holds(open, door, true)),
          agent(h, 'Open'(R7), R7), duration(h, 'Open'(_), fixed(5)), effect(h, 'Open'(_), fluent(open, door), true),
          agent(h, 'Carry'(R8, _), R8), agent(h, 'Carry'(_, S8), S8), duration(h, 'Carry'(_, _), fixed(5)),
          definition(h, 'Main', F9, deadline(70, call(F9, w, 'Work'(r1))))
        ], _).

hall_gone :- drop_facts(h, _), forget_session(s), forget_session(t), drop_facts(t, _).

%   The session s has P left.
left(P) :-
    no_guide(Guide),
    situation(h, act(Guide), 1, 0, S),
    keep(s, P, S).

%   What P may come to below a choice, looked ahead.
prospects_of(P, Below, Prospects) :-
    left(P),
    kept(s, P, S0),
    travel(tables([p1, p2], [robot(r1, 1, [5, -1]), robot(r2, 2, [-1, -1])], [[[0, 7], [7, 0]], [[0, -1], [-1, 0]]]), Travel),
    with_mode(S0, plan(Travel), S),
    keep_ahead(s, P, S),
    prospects(prospects(s, Below), Prospects).

obstacles(P, Obstacles) :- prospects_of(P, all, Prospects), get_dict(obstacles, Prospects, Obstacles).

%   After Changes, the session t has P in the situation S.
supposing(P0, Changes, P, S) :- left(P0), suppose(supposition(s, t, Changes), _), kept(t, P, S).

:- begin_tests(hypotheses, [setup(hall), cleanup(hall_gone)]).

test('choices are told with all that could be chosen', Choices == [['f/p', individual, [r1, r2], [r1, r2]], ['f/c', branch, [1, 2], ['Work', nothing]]]) :-
    prospects_of([pick(f, p, X, 'Robot', call(f, w, 'Work'(X))), choice(f, c, [call(f, v, 'Work'(r2)), []])], all, Prospects),
    get_dict(choices, Prospects, Choices).
test('parts in any order have a choice for each turn', Ids == ['f/o/1', 'f/o/2']) :-
    prospects_of(any_order(f, o, [call(f, w, 'Work'(r2)), call(f, v, 'Work'(r2))]), all, Prospects),
    get_dict(choices, Prospects, Choices),
    findall(Id, member([Id, part, [1, 2], _], Choices), Ids).
test('claims and deadlines', Claims-Deadlines == [['f/x', door]]-[['Main', 70]]) :-
    prospects_of([call(f, x, 'Pass'(r2)), call(f, m, 'Main')], all, Prospects),
    get_dict(claims, Prospects, Claims), get_dict(deadlines, Prospects, Deadlines).
test('a missing capability and a broken limit', Obstacles == [[lacks, 'Lift', r1, 'Lifter'],
        [broken, 'Lift', [r1], true, payload, r1, 2, at_least, 3, [weight, box]],
        [broken, 'Lift', [r1], true, weight, box, 3, at_most, 2, [payload, r1]]]) :-
    obstacles(call(f, l, 'Lift'(r1, box)), Obstacles).
test('what is not known either', Broken == [weight, box, 3, at_most, null, [payload, r2]]) :-
    obstacles(call(f, l, 'Lift'(r2, box)), [_, [broken, 'Lift', [r2], true|Broken]]).
test('what the program itself may change is not lasting', Lasting == [true, false]) :-
    obstacles(call(f, x, 'Pass'(r2)), [[_, _, _, L1|_]]),
    obstacles([call(f, o, 'Open'(r2)), call(f, x, 'Pass'(r2))], [[_, _, _, L2|_]]),
    Lasting = [L1, L2].
test('a rule that nothing satisfies: where one fact would do', Obstacles == [
        [broken, s, [], true, open, door, false, equal, true, null], [broken, s, [], true, color, door, null, equal, red, null]]) :-
    obstacles(test(some([D-'Door'], all([holds(open, D, true), holds(weight, box, 3)]))), [First]),
    obstacles(test(some([D-'Door'], all([holds(open, D, false), holds(color, D, red)]))), [Second]),
    Obstacles = [First, Second].
test('a rule that something satisfies and that should not be', Obstacles == [[broken, s, [], true, open, door, false, differs, false, null]]) :-
    obstacles(test(not(some([D-'Door'], holds(open, D, false)))), Obstacles).
test('a sum that is too small, and a class', Obstacles == [[broken, s, [], true, payload, r1, 2, at_least, 7, null], [is_no, s, [], r1, 'Lifter']]) :-
    obstacles([test(compare(at_least, value(payload, r1), plus(value(weight, box), 4))), test(is_a(r1, 'Lifter'))], Obstacles).
test('no way, and a way by another place', Obstacles == [[way, 'Go', r2, p1]]) :-
    obstacles([call(f, a, 'Go'(r1, p2)), call(f, b, 'Go'(r2, p1))], Obstacles).
test('a battery that is too small for a step', Obstacles == [[battery, 'Work', r1, 60, 50]]) :-
    obstacles(call(f, w, 'Work'(r1)), Obstacles).
test('one robot twice', Obstacles == [[twice, 'Carry', r1]]) :-
    obstacles(call(f, c, 'Carry'(r1, r1)), Obstacles).
test('below a choice only', Obstacles == [[battery, 'Work', r1, 60, 50]]) :-
    prospects_of([pick(f, p, X, 'Robot', call(f, w, 'Work'(X))), call(f, g, 'Go'(r2, p1))], 'f/p', Prospects),
    get_dict(obstacles, Prospects, Obstacles).

test('another session is made; this one stays', P-V-W == Q-true-false) :-
    Q = call(f, x, 'Pass'(r2)),
    supposing(Q, [value(open, door, true)], P, S),
    once(fluent_value(open, door, V, S)),
    kept(s, _, S0), once(fluent_value(open, door, W, S0)).
test('only one label is left', all(X == [r2])) :-
    supposing([], [only('f/p', r2)], _, S),
    member(X, [r1, r2]), \+ excluded('f/p', X, S).
test('a class is changed in facts of its own') :-
    supposing([], [kind(r1, 'Lifter')], _, S),
    revision(S, t), once(kind(t, r1, 'Lifter')), once(kind(t, r2, 'Lifter')), \+ kind(h, r1, 'Lifter').
test('a deadline is changed where it is written', Body-Old == deadline(90, call(x, w, 'Work'(r1)))-deadline(70, call(x, w, 'Work'(r1)))) :-
    supposing([], [deadline('Main', 70, 90)], _, _),
    definition(t, 'Main', x, Body), definition(h, 'Main', x, Old).
test('and in what has begun', P == [deadline(90, []), deadline(80, [])]) :-
    supposing([deadline(70, []), deadline(80, [])], [deadline('Main', 70, 90)], P, _).
test('more robots', N == 2) :- supposing([], [team(2)], _, S), limit(S, N).

:- end_tests(hypotheses).
