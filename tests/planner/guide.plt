:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(guide)).

house :-
    load_facts([ kind(g, r1, 'Robot'), kind(g, r2, 'Robot'), claims(g, 'Pass'(_, D), D) ], _).

house_gone :- drop_facts(g, _).

along(Guide, S) :- situation(g, act(Guide), 2, 0, S).
proposed(Choices, Steps, S) :- proposed_guide(Choices, Steps, Guide), along(Guide, S).

:- begin_tests(guide, [setup(house), cleanup(house_gone)]).

test('of a choice that is come to several times, all are kept in order', Taken == [r1, r2, r1]) :-
    proposed([p-r1, q-r2, p-r2, p-r1], [], S0), next_choice(p, A, S0), take_choice(p, A, S0, S1),
    next_choice(p, B, S1), take_choice(p, B, S1, S2), next_choice(p, C, S2), Taken = [A, B, C].
test('where all have been taken, it says no more', fail) :-
    proposed([p-r1], [], S0), take_choice(p, r1, S0, S), next_choice(p, _, S).
test('a choice that it does not know is noted all the same', Log == [chose(q, 2)]) :-
    proposed([p-r1], [], S0), take_choice(q, 2, S0, S), take_log(S, Log, _).
test('looking ahead freely there is no guide', fail) :- situation(g, plan(t), 2, 0, S), guided(S).
test('what does not come from the guide leaves it as it is', X == r1) :-
    proposed([p-r1], [], S0), take_choice(p, r2, S0, S), next_choice(p, X, S).

test('a robot does its steps in order', Order == [true, false]) :-
    proposed([], [a-[r1], b-[r1]], S),
    findall(Turn, ( member(Id, [a, b]), ( in_order(Id, 'Step', [r1], S, _) -> Turn = true ; Turn = false ) ), Order).
test('then it is the turn of the next') :-
    proposed([], [a-[r1], b-[r1]], S0), in_order(a, 'Step', [r1], S0, S), next_step(r1, b, S), in_order(b, 'Step', [r1], S, _).
test('two robots must both have their turn', fail) :-
    proposed([], [a-[r2], c-[r1, r2]], S), in_order(c, 'Carry', [r1, r2], S, _).
test('a resource serves in order too', fail) :-
    proposed([], [a-[r1, resource(door)], b-[r2, resource(door)]], S), in_order(b, 'Pass'(r2, door), [r2], S, _).
test('another resource does not wait for it') :-
    proposed([], [a-[r1, resource(door)], b-[r2, resource(gate)]], S), in_order(b, 'Pass'(r2, gate), [r2], S, _).
test('steps that the plan does not know wait for nothing') :-
    proposed([], [a-[r1]], S0), in_order(b, 'Step', [r1], S0, S), next_step(r1, a, S).

test('an execution becomes the guide that repeats it', Steps-Door == [[a, c], [b, c]]-[a, b]) :-
    situation(g, plan(t), 2, 0, S0),
    guide([chose(p, r1), started(a, 'Pass'(r1, door), [r1], 0, 10), begun(b, 'Pass'(r2, door)), started(b, 'Step', [r2], 10, 20),
           ended(b, 'Pass'(r2, door)), started(c, 'Carry', [r1, r2], 20, 30)], S0, Guide),
    along(Guide, S), next_choice(p, r1, S),
    findall(Ids, ( member(Who, [r1, r2]), served(Who, S, Ids) ), Steps), served(resource(door), S, Door).
test('open are the steps that have not begun', Ids == [b, c]) :-
    proposed([], [a-[r1], b-[r1], c-[r2, r1]], S0), in_order(a, 'Step', [r1], S0, S), guide_of(S, Guide), open_steps(Guide, Ids).
test('those that have begun under the plan before are left out', Ids == [c]) :-
    proposed_guide([], [a-[r1], b-[r1], c-[r1]], Guide0), without([a, b], Guide0, Guide), open_steps(Guide, Ids).

%   The steps of a robot or resource, in order.
served(Who, S, [Id|Ids]) :-
    next_step(Who, Id, S), !,
    in_order(Id, 'Step', [Who], S, S1),
    served(Who, S1, Ids).
served(_, _, []).

:- end_tests(guide).
