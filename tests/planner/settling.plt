:- use_module(library(plunit)).
:- use_module(library(lists)).
:- use_module(library(random)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(search)).
:- use_module(planner_golog(settling)).
:- use_module(planner_golog(travel)).

% Three robots; Think needs none; two carry; one at a time passes; Seek keeps its robot.

hall :-
    load_facts(
        [ kind(q, r1, 'Robot'), kind(q, r2, 'Robot'), kind(q, r3, 'Robot'),
          agent(q, 'Work'(R1), R1), duration(q, 'Work'(_), fixed(10)), duration(q, 'Think', fixed(7)),
          agent(q, 'Carry'(R2, S2), R2), agent(q, 'Carry'(R3, S3), S3), duration(q, 'Carry'(_, _), fixed(25)),
          agent(q, 'Pass'(R4, _), R4), claims(q, 'Pass'(_, D4), D4), duration(q, 'Pass'(_, _), fixed(5)),
          duration(q, 'Scan'(_), fixed(6)), claims(q, 'Scan'(D5), D5),
          agent(q, 'Seek'(R6), R6), keeps_robot(q, 'Seek'),
          definition(q, 'Seek'(R7), F7, [call(F7, go, 'Work'(R7)), call(F7, think, 'Think'), call(F7, look, 'Work'(R7))]),
          definition(q, 'Nothing', _, []), effect(q, 'Nothing', fluent(nothing, it), true)
        ], _),
    S2 = R3, R2 = S3.

hall_gone :- drop_facts(q, _).

looking(S) :- no_travel(Travel), situation(q, plan(Travel), 3, 0, S).
acting(S) :- no_guide(Guide), situation(q, act(Guide), 3, 0, S).

% A program of some depth; N counts its constructs, so that each has a name.
program(0, P, N0, N) :- !, task(P, N0, N).
program(Depth, P, N0, N) :-
    Depth1 is Depth - 1,
    random_member(Kind, [task, row, row, conc, conc, choice, pick, any_order, star, deadline]),
    construct(Kind, Depth1, P, N0, N).

construct(task, _, P, N0, N) :- task(P, N0, N).
construct(row, D, Ps, N0, N) :- programs(D, Ps, N0, N).
construct(conc, D, conc(Ps), N0, N) :- programs(D, Ps, N0, N).
construct(choice, D, choice(f, Id, Ps), N0, N) :- name(N0, Id, N1), programs(D, Ps, N1, N).
construct(any_order, D, any_order(f, Id, Ps), N0, N) :- name(N0, Id, N1), programs(D, Ps, N1, N).
construct(pick, D, pick(f, Id, R, 'Robot', [call(f, Work, 'Work'(R)), P]), N0, N) :-
    name(N0, Id, N1), name(N1, Work, N2), program(D, P, N2, N).
construct(star, D, star(f, Id, [call(f, Work, 'Work'(r1)), P]), N0, N) :-
    name(N0, Id, N1), name(N1, Work, N2), program(D, P, N2, N).
construct(deadline, D, deadline(1000, P), N0, N) :- program(D, P, N0, N).

programs(D, Ps, N0, N) :- random_between(2, 3, K), length(Ps, K), foldl(program(D), Ps, N0, N).

task(call(f, Id, Head), N0, N) :-
    name(N0, Id, N),
    random_permutation([r1, r2, r3], [R, S|_]),
    random_member(Head, ['Work'(R), 'Work'(R), 'Think', 'Carry'(R, S), 'Pass'(R, door), 'Scan'(door), 'Seek'(R), 'Nothing']).

name(N0, Id, N) :- atom_concat(s, N0, Id), N is N0 + 1.

%   Along its plan, whichever step ends next, seeing to what it touches starts what seeing to all starts.
same_along(Seed) :-
    set_random(seed(Seed)),
    program(3, P, 1, _),
    looking(S0), best_plan(P, S0, 60, Result),
    (   Result = plan(_, _, _, Events, [], _)
    ->  guide(Events, S0, Guide),
        situation(q, act(Guide), 3, 0, S1), set_data(planned, true, S1, S2),
        advance(all, P, S2, Q, S),
        ended(Q, S, Q, S)
    ;   true
    ).

ended(P1, S1, P2, S2) :-
    running(S1, Runs),
    (   Runs == []
    ->  settled(P1, S1), settled(P2, S2)
    ;   random_member(run(_, _, Id, Head), Runs),
        stop(Id, S1, T1), apply_effects(Head, T1, U1),
        stop(Id, S2, T2), apply_effects(Head, T2, U2),
        ( waits(P2, U2) -> Ended = all ; Ended = [Id] ),
        advance(all, P1, U1, Q1, V1),
        advance(Ended, P2, U2, Q2, V2),
        started(V1, Ids1), started(V2, Ids2),
        ( Ids1 == Ids2 -> true ; throw(error(started(Id, Ids1, Ids2), _)) ),
        ended(Q1, V1, Q2, V2)
    ).

settled(P, S) :- advance(all, P, S, Q, _), ( final_or_empty(Q, S) -> true ; throw(error(left(Q), _)) ).
final_or_empty(P, S) :- complete(P, S, []).

started(S, Ids) :-
    log(S, Log),
    findall(Id, member(started(Id, _, _, _, _), Log), Ids0),
    msort(Ids0, Ids).

:- begin_tests(settle, [setup(hall), cleanup(hall_gone)]).

test('what has ended is left behind', Q == call(f, b, 'Work'(r1))) :-
    acting(S), settle([running(a), conc([running(b), []]), call(f, b, 'Work'(r1))], S, Q, _).
test('what runs is not', Q == [running(a), call(f, b, 'Think')]) :-
    acting(S0), begin_step(a, 'Work'(r1), [r1], 10, S0, S), settle([running(a), call(f, b, 'Think')], S, Q, _).
test('a process whose body is done ends, with its effects', Q-V == []-true) :-
    acting(S), settle(scope(i, 'Nothing', [running(a)]), S, Q, T), fluent_value(nothing, it, V, T).
test('so do all around it', Q == []) :- acting(S), settle(picked(p-r1, x, deadline(9, conc([[running(a)]]))), S, Q, _).
test('a choice is left open', Q == P) :- acting(S), P = choice(f, c, [[], []]), settle(P, S, Q, _).
test('looking for a plan, so is an iteration at the end of a process', Q == P) :-
    looking(S), P = scope(i, 'Nothing', star(f, s, call(f, a, 'Think'), 1)), settle(P, S, Q, _).
test('along a guide it is not', Q == []) :-
    acting(S), settle(scope(i, 'Nothing', star(f, s, call(f, a, 'Think'), 1)), S, Q, _).

:- end_tests(settle).

:- begin_tests(advance, [setup(hall), cleanup(hall_gone)]).

test('all that may start starts', Ids == ['f/a', 'f/b', 'f/c']) :-
    acting(S), advance(all, conc([call(f, a, 'Work'(r1)), call(f, b, 'Work'(r2)), call(f, c, 'Think')]), S, _, T), started(T, Ids).
test('a step that has ended lets its own branch go on, and nothing else', Ids == ['f/a', 'f/b', 'f/d']) :-
    acting(S), P = conc([[call(f, a, 'Think'), call(f, b, 'Think')], [call(f, d, 'Think'), call(f, e, 'Think')]]),
    advance(all, P, S, Q, T), stop('f/a', T, T1), advance(['f/a'], Q, T1, _, T2), started(T2, Ids).
test('a robot that is free goes where its guide sends it', Ids == ['f/a', 'f/b']) :-
    proposed_guide([], ['f/a'-[r1], 'f/b'-[r1]], Guide), situation(q, act(Guide), 3, 0, S),
    advance(all, conc([call(f, b, 'Work'(r1)), call(f, a, 'Work'(r1))]), S, Q, T),
    stop('f/a', T, T1), advance(['f/a'], Q, T1, _, T2), started(T2, Ids).
test('a computation that has waited for a resource is woken', Ids == ['f/a', 'f/b', 'f/c']) :-
    acting(S), P = conc([call(f, a, 'Scan'(door)), call(f, b, 'Scan'(door)), call(f, c, 'Work'(r1))]),
    advance(all, P, S, Q, T), stop('f/a', T, T1), once(waits(Q, T1)), advance(all, Q, T1, _, T2), started(T2, Ids).
test('along a plan, what is touched is all there is to see to', forall(between(1, 600, Seed))) :- same_along(Seed).

:- end_tests(advance).
