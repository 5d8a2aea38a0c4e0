% Durations: what holds for all, for a robot, for a robot at a place; and what bounds know of it.
:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(network)).
:- use_module(planner_golog(travel)).

% Look takes r1 longer, but not at p1; Wipe names its place, where r1 succeeds every other time.

kitchen :-
    load_facts([ kind(d, r1, 'Robot'), kind(d, r2, 'Robot'), fluent(d, locatedAt, r1, p2),
                 agent(d, 'Look'(A), A), duration(d, 'Look'(_), fixed(10)), odds(d, 'Look', 0.4),
                 learned(d, 'Look', r1, anywhere, 40, 0.5), learned(d, 'Look', r1, at(p1), 30, 0.75),
                 agent(d, 'Wipe'(B, _), B), duration(d, 'Wipe'(_, _), fixed(20)), takes_place(d, 'Wipe'(_, C), C),
                 learned(d, 'Wipe', r1, at(p1), 20, 0.5),
                 agent(d, 'Go'(D, _), D), duration(d, 'Go'(E, F), travel(E, F, 5)), effect(d, 'Go'(G, H), fluent(locatedAt, G), H),
                 takes_place(d, 'Go'(_, I), I), learned(d, 'Go', r1, at(p2), 7, 0.5),
                 learned(d, 'Wipe', r1, at(p2), 4, 0.5),
                 agent(d, 'Put'(N, _, _), N), duration(d, 'Put'(_, _, _), fixed(1)),
                 effect(d, 'Put'(_, O, P), fluent(stands, O), P), parameter(d, 'Put'(_, _, Q), Q, 'Location'),
                 duration(d, 'Shift'(_, _), fixed(1)), effect(d, 'Shift'(R, T), fluent(locatedAt, R), T),
                 parameter(d, 'Shift'(U, _), U, 'Robot'), fluent(d, stands, crate, p1),
                 agent(d, 'Visit'(J, _), J), keeps_robot(d, 'Visit'),
                 definition(d, 'Visit'(K, L), M, [call(M, go, 'Go'(K, L)), call(M, look, 'Look'(K))])
               ], _).

kitchen_gone :- drop_facts(d, _).

looking(S) :-
    travel(tables([p1, p2], [robot(r1, 1, [100, 200]), robot(r2, 1, [300, 400])], [[[0, 900], [900, 0]]]), Travel),
    situation(d, plan(Travel), 2, 0, S).
standing_at(R, P, S) :- looking(S0), set_data(locatedAt-R, P, S0, S).

takes(Head, S, Ms) :- one_step(Head, Duration, S), milliseconds(Head, Duration, Ms, S).

:- begin_tests(durations, [setup(kitchen), cleanup(kitchen_gone)]).

test('what may fail takes longer on the average', Ms == 25) :- looking(S), takes('Look'(r2), S, Ms).
test('halves are rounded to even', Rounded == [2, 2, 4, 1]) :-
    findall(Ms, ( member(Once-Odds, [1-0.4, 1-0.5, 7-2, 1-1.0]), expected(Once, Odds, Ms) ), Rounded).
test('a robot that was measured takes as long as that, where it is', Mss == [80, 80, 80]) :-
    findall(Ms, ( member(P, [p2, p3, p4]), standing_at(r1, P, S), takes('Look'(r1), S, Ms) ), Mss).
test('a place where it was measured comes first', Ms == 40-80) :-
    standing_at(r1, p1, S1), takes('Look'(r1), S1, At_p1), looking(S2), takes('Look'(r1), S2, At_p2), Ms = At_p1-At_p2.
test('the place that a process names counts, not where the robot is', Mss == [40, 8]) :-
    standing_at(r1, p2, S), findall(Ms, ( member(P, [p1, p2]), takes('Wipe'(r1, P), S, Ms) ), Mss).
test('others take what is stated', Ms == 20) :- standing_at(r2, p1, S), takes('Wipe'(r2, p1), S, Ms).
test('a way is gone as often as it is tried', Ms == 414) :- looking(S), takes('Go'(r1, p2), S, Ms).
test('a bound is the least of all places', Ms == 40) :- looking(S), least_time('Look'(r1), 0, 10, Ms, S).
test('of the place that is named, if it is', Mss == [40, 8]) :-
    looking(S), findall(Ms, ( member(P, [p1, p2]), least_time('Wipe'(r1, P), 0, 20, Ms, S) ), Mss).
test('a place that is not known yet may be any', Ms == 8) :-
    looking(S), least_time('Wipe'(r1, fluent(stands, box)), 0, 20, Ms, S).

:- end_tests(durations).

% ------------------------------------------------------------------------------ in a task network

steps(P, Steps-Exact) :-
    looking(S), network(P, S, network(Root, _, _, _, _, Exact)),
    findall(step(Id, Odds, Ms), ( sub_term(T, Root), nonvar(T), T = step(Id, _, _, Odds, Ms, _, _) ), Steps).

sub_term(T, T).
sub_term(X, T) :- compound(T), arg(_, T, Part), sub_term(X, Part).

:- begin_tests(durations_in_networks, [setup(kitchen), cleanup(kitchen_gone)]).

test('what comes first begins where the robot is', R == [step('f/a', 0.5, 80)]-true) :-
    steps(call(f, a, 'Look'(r1)), R).
test('a robot that is kept is where it went', R == [step('f/v/go', 1, 5), step('f/v/look', 0.75, 40)]-true) :-
    steps(call(f, v, 'Visit'(r1, p1)), R).
test('else it may be anywhere: the least, and a relaxation', R == [step('f/g', 1, 5), step('f/a', 0.75, 40)]-false) :-
    steps([call(f, g, 'Go'(r1, p1)), call(f, a, 'Look'(r1))], R).
test('another robot is not concerned', R == [step('f/g', 1, 5), step('f/a', 0.4, 25)]-true) :-
    steps([call(f, g, 'Go'(r2, p1)), call(f, a, 'Look'(r2))], R).
test('beside something else, too', R-Exact == [0.75, 0.75]-false) :-
    steps(conc([call(f, a, 'Look'(r1)), call(f, b, 'Look'(r1))]), Steps-Exact),
    findall(Odds, member(step(_, Odds, _), Steps), R).
test('nor is a robot where it names a place that is to be found out', R == [step('f/a', 1, 8)]-false) :-
    steps(call(f, a, 'Wipe'(r1, fluent(stands, box))), R).
test('the place of a thing is known as long as nothing puts it elsewhere', R == [step('f/g', 0.5, 14), step('f/a', 0.5, 40)]-true) :-
    steps([call(f, g, 'Go'(r1, p2)), call(f, a, 'Wipe'(r1, fluent(stands, crate)))], R).
test('else the network would go where it was', [forall(member(P, ['Go'(r1, At), 'Wipe'(r1, At)])), throws(error(no_network(argument(P)), _))]) :-
    At = fluent(stands, crate), steps([call(f, p, 'Put'(r1, crate, p2)), call(f, a, P)], _).
test('nor does it know where a robot is that others move', throws(error(no_network(moves_a_robot), _))) :-
    steps([call(f, s, 'Shift'(r1, p1)), call(f, a, 'Look'(r1))], _).
test('robots that were measured are like no other', Options == [[r1], [r2]]) :-
    looking(S), network(pick(f, p, X, 'Robot', call(f, a, 'Look'(X))), S, network(alt(_, All), _, _, _, _, _)),
    findall(Labels, member(option(Labels, _), All), Options).
test('where the process asks for nothing that was', Options == [[r1, r2]]) :-
    load_facts([agent(d, 'Sit'(A), A), duration(d, 'Sit'(_), fixed(10))], _),
    looking(S), network(pick(f, p, X, 'Robot', call(f, a, 'Sit'(X))), S, network(alt(_, All), _, _, _, _, _)),
    findall(Labels, member(option(Labels, _), All), Options).

:- end_tests(durations_in_networks).
