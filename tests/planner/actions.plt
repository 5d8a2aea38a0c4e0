:- use_module(library(plunit)).
:- use_module(library(assoc)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).

% Two robots that carry a tray together, a door for one at a time and a dock for two.

house :-
    load_facts([ kind(h, r1, 'Robot'), kind(h, r2, 'Robot'), kind(h, r2, 'Lifter'), value(h, capacity, dock, 2),
                 value(h, energy_J, r1, 100), value(h, power_W, r1, 4),
                 agent(h, 'Carry'(A, B), A), agent(h, 'Carry'(A, B), B), duration(h, 'Carry'(_, _), fixed(100)),
                 agent(h, 'Pass'(C, _), C), claims(h, 'Pass'(_, D), D), duration(h, 'Pass'(_, _), fixed(20)),
                 agent(h, 'Lift'(E), E), requires(h, 'Lift', 'Lifter'), duration(h, 'Lift'(_), fixed(15)), odds(h, 'Lift', 0.4),
                 agent(h, 'Cross'(F, _), F), claims(h, 'Cross'(_, G), G), keeps_robot(h, 'Cross'),
                 definition(h, 'Cross'(H, I), J, call(J, pass, 'Pass'(H, I)))
               ], _).

house_gone :- drop_facts(h, _).

initially(S) :- situation(h, plan(t), 2, 1000, S).

:- begin_tests(actions, [setup(house), cleanup(house_gone)]).

test('running steps end in order of time', End-Next == 1010-1050) :-
    initially(S0), begin_step(a, 'A', [r1], 50, S0, S1), begin_step(b, 'B', [r2], 10, S1, S2),
    next_end(S2, End), stop(b, S2, S3), next_end(S3, Next).
test('who has begun something is in the team for good') :-
    initially(S0), begin_step(a, 'A', [r1], 5, S0, S1), begin_step(b, 'B', [r2], 5, S1, S2), stop(a, S2, S3),
    idle([r1], S3), \+ idle([r2], S3), \+ idle([r3], S3), \+ idle([r1, r3], S3).
test('what is late is expected to end now', Ends == [2000, 2500]) :-
    initially(S0), begin_step(a, 'A', [r1], 50, S0, S1), begin_step(b, 'B', [r2], 1500, S1, S2), at_time(S2, 2000, S3),
    catch_up(S3, S), running(S, Runs), findall(E, member(run(E, _, _, _), Runs), Ends).
test('all robots of a process do it together', Agents == [r1, r2]) :-
    initially(S), agents_of('Carry'(r1, r2), Agents, S).
test('nobody carries a tray with himself', fail) :- initially(S), may_begin(c, 'Carry'(r1, r1), _, S).
test('who is busy carries nothing', fail) :-
    initially(S0), begin_step(a, 'Pass'(r2, door), [r2], 20, S0, S), idle([r1, r2], S).
test('a door lets one through at a time', Free == [false, true]) :-
    initially(S0), begin_step(a, 'Pass'(r1, door), [r1], 20, S0, S1),
    ( may_begin(b, 'Pass'(r2, door), _, S1) -> Now = true ; Now = false ),
    stop(a, S1, S2), ( may_begin(b, 'Pass'(r2, door), _, S2) -> Then = true ; Then = false ), Free = [Now, Then].
test('a resource of capacity two serves two', Free == [true, false]) :-
    initially(S0), begin_step(a, 'Pass'(r1, dock), [r1], 20, S0, S1),
    ( may_begin(b, 'Pass'(r2, dock), _, S1) -> Two = true ; Two = false ),
    begin_step(b, 'Pass'(r2, dock), [r2], 20, S1, S2),
    ( may_begin(c, 'Pass'(r3, dock), _, S2) -> Three = true ; Three = false ), Free = [Two, Three].
test('the steps of a process use what it has claimed') :-
    initially(S0), begin_scope('f/x', 'Cross'(r1, door), [r1], S0, S1),
    may_begin('f/x/pass', 'Pass'(r1, door), _, S1), \+ may_begin(y, 'Pass'(r2, door), _, S1).
test('a process that ends gives back what it had', Same == true) :-
    initially(S0), begin_scope('f/x', 'Cross'(r1, door), [r1], S0, S1), end_scope('f/x', 'Cross'(r1, door), S1, S2),
    progressed(S0, K0), progressed(S2, K2), ( K0 == K2 -> Same = true ; Same = K0-K2 ).
test('what is given up gives back what it had', Same == true) :-
    initially(S0), begin_scope('f/x', 'Cross'(r1, door), [r1], S0, S1), give_up(['f/x'-'Cross'(r1, door)], S1, S2),
    progressed(S0, K0), progressed(S2, K2), ( K0 == K2 -> Same = true ; Same = K0-K2 ).
test('only who is capable begins', Who == [r2]) :-
    initially(S), findall(R, ( member(R, [r1, r2]), may_begin(l, 'Lift'(R), _, S) ), Who).
test('a robot works as long as its energy lasts', Ms == 25000) :- initially(S), work_limit(r1, Ms, S).
test('a robot without a battery works for ever', fail) :- initially(S), work_limit(r2, _, S).
test('it does not begin what its energy does not last for') :-
    initially(S0), begin_step(a, 'Pass'(r1, p), [r1], 20_000, S0, S1), stop(a, S1, S2),
    begin_step(b, 'Pass'(r1, p), [r1], 5_000, S2, _), \+ begin_step(b, 'Pass'(r1, p), [r1], 5_001, S2, _).

:- end_tests(actions).
