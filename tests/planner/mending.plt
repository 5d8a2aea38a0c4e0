:- use_module(library(plunit)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(yall)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(mending)).
:- use_module(planner_golog(planning)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(sessions)).
:- use_module(planner_golog(steps)).

% Two robots watch; Main has one of them, whichever is picked, watch and report, beside a count.

mended :-
    load_facts(
        [ kind(m, r1, 'Robot'), kind(m, r2, 'Robot'),
          agent(m, 'Watch'(R1), R1), duration(m, 'Watch'(_), fixed(10)),
          duration(m, 'Count', fixed(5)),
          agent(m, 'Guard'(R2), R2), keeps_robot(m, 'Guard'),
          definition(m, 'Guard'(R3), F3, [call(F3, watch, 'Watch'(R3)), call(F3, report, 'Watch'(R3))]),
          definition(m, 'Main', F4, conc([ pick(F4, pick, R4, 'Robot', call(F4, guard, 'Guard'(R4))),
                                           call(F4, count, 'Count') ])),
          definition(m, 'Either', F7, choice(F7, way, [call(F7, count, 'Count'), call(F7, guard, 'Guard'(r2))])),
          definition(m, 'Only', F8, choice(F8, way, [call(F8, count, 'Count')])),
          agent(m, 'Fly'(R9), R9), requires(m, 'Fly', wings), duration(m, 'Fly'(_), fixed(1)),
          definition(m, 'Go'(R10), F10, choice(F10, way, [call(F10, fly, 'Fly'(R10)), call(F10, guard, 'Guard'(R10))])),
          definition(m, 'Ways', F11, pick(F11, pick, R11, 'Robot', call(F11, go, 'Go'(R11)))),
          % Look finds out whether it is clear; a leader is picked, then a follower.
          agent(m, 'Look'(R5, _), R5), duration(m, 'Look'(_, _), fixed(3)),
          definition(m, 'Team', F6, pick(F6, leader, L6, 'Robot', [ call(F6, lead, 'Watch'(L6)),
                                                                   pick(F6, follower, R6, 'Robot', call(F6, guard, 'Guard'(R6))) ]))
        ], _).

mended_gone :- drop_facts(m, _).

open(Key) :- open(Key, 'Main').
open(Key, Head) :- open_session(request(Key, m, Head, 2, 0), _).
plan(Key, Now, Dict) :- look_ahead(ahead(Key, Now, tables([], [], [])), _), search_plan(search(Key, 1000, -1), Dict).
next(Key, Now, Events) :- next_actions(next(Key, Now), Dict), shown(Dict, Events).
% Events as kind-Id-robot.
shown(Dict, Shown) :-
    findall(K-Id-R, ( get_dict(events, Dict, Events), member([K, Id, Rs|_], Events), robot(Rs, R) ), Shown).

robot([], none).
robot([R], R).

:- begin_tests(mending, [setup(mended), cleanup(mended_gone)]).

test('after a failure the choice is open again, without who failed', Found == [true, r1, r2]) :-
    open(f1), plan(f1, 0, _), next_actions(next(f1, 0), _),
    retry(failed(f1, 5, 'f1/task/guard/watch', 0), Dict), plan(f1, 5, _), next_actions(next(f1, 5), Next),
    shown(Next, Events), memberchk(started-'f1/task/guard/watch'-Robot, Events),
    _{retry: Retry, excluded: Excluded} :< Dict,
    Found = [Retry, Excluded, Robot].
test('before it is planned again, nothing is given to who failed', Events == []) :-
    open(f2), plan(f2, 0, _), next_actions(next(f2, 0), _),
    retry(failed(f2, 5, 'f2/task/guard/watch', 0), _), next_actions(next(f2, 5), Next), shown(Next, Events).
test('where all have failed, there is no plan', Status == unsolvable_proven) :-
    open(f3), plan(f3, 0, _), next_actions(next(f3, 0), _),
    retry(failed(f3, 5, 'f3/task/guard/watch', 0), _), plan(f3, 5, _), next_actions(next(f3, 5), _),
    retry(failed(f3, 9, 'f3/task/guard/watch', 0), _), plan(f3, 9, Dict),
    get_dict(status, Dict, Status).
test('what was not chosen cannot be retried', Retry == false) :-
    open(f4), plan(f4, 0, _), next_actions(next(f4, 0), _), retry(failed(f4, 5, 'f4/task/count', 0), Dict),
    get_dict(retry, Dict, Retry).
test('a failure in the middle of a process begins it again', Events == [begun-'f5/task/guard'-r2,
                                                                        started-'f5/task/guard/watch'-r2]) :-
    open(f5), plan(f5, 0, _), next_actions(next(f5, 0), _), report(done(f5, 10, 'f5/task/guard/watch', []), _),
    retry(failed(f5, 15, 'f5/task/guard/report', 0), _), plan(f5, 15, _), next_actions(next(f5, 15), Next),
    shown(Next, Events).

test('who was chosen further out is excluded where that is said', Found == [true, r2, r1]) :-
    open(o1, 'Team'), plan(o1, 0, _), next_actions(next(o1, 0), _), report(done(o1, 10, 'o1/task/lead', []), Dict0),
    shown(Dict0, Events0), memberchk(started-'o1/task/guard/watch'-_, Events0),
    retry(failed(o1, 15, 'o1/task/guard/watch', 1), Dict), plan(o1, 15, _), next(o1, 15, Events),
    memberchk(started-'o1/task/lead'-Robot, Events),
    _{retry: Retry, excluded: Excluded} :< Dict,
    Found = [Retry, Excluded, Robot].
test('another branch is taken where one has failed', Found == [[1], 'Count', [started-'e1/task/guard/watch'-r2]]) :-
    open(e1, 'Either'), plan(e1, 0, _), next(e1, 0, Began), Began = [_|_],
    surroundings(around(e1, 'e1/task/count'), Around), get_dict(chosen, Around, Chosen),
    retry(failed(e1, 5, 'e1/task/count', 0), Dict), get_dict(excluded, Dict, Excluded),
    plan(e1, 5, _), next(e1, 5, Events), exclude([begun-_-_]>>true, Events, Started),
    Found = [Chosen, Excluded, Started].
test('a copy goes on though its robot is not capable of the branches that were not taken', Runs == ['c1/task/go/guard/watch']) :-
    open(c1, 'Ways'), plan(c1, 0, _), next_actions(next(c1, 0), _),
    fork_session(fork(c1, c1_copy, 5, m, []), _), kept(c1_copy, _, S), running(S, Running),
    findall(Id, member(run(_, _, Id, _), Running), Runs).
test('a branch that is the only one was not chosen', Found == [[], false]) :-
    open(e2, 'Only'), plan(e2, 0, _), next_actions(next(e2, 0), _),
    surroundings(around(e2, 'e2/task/count'), Around), get_dict(chosen, Around, Chosen),
    retry(failed(e2, 5, 'e2/task/count', 0), Dict), get_dict(retry, Dict, Retry),
    Found = [Chosen, Retry].
test('where so many choices were not made, none is made again', Retry == false) :-
    open(o2, 'Team'), plan(o2, 0, _), next_actions(next(o2, 0), _),
    retry(failed(o2, 5, 'o2/task/lead', 1), Dict), get_dict(retry, Dict, Retry).
test('what is around an action', Found == [[['w1/task', [], 'Main'], ['w1/task/guard', [r1], 'Guard', r1]], [r1]]) :-
    open(w1), plan(w1, 0, _), next_actions(next(w1, 0), _), surroundings(around(w1, 'w1/task/guard/watch'), Dict),
    _{processes: Processes, chosen: Chosen} :< Dict, Found = [Processes, Chosen].
test('a process is begun again by the same robot, after another one',
     Found == [[], [started-'b1/task/guard/clear'-none], [begun-'b1/task/guard'-r1, started-'b1/task/guard/watch'-r1]]) :-
    open(b1), plan(b1, 0, _), next_actions(next(b1, 0), _), report(done(b1, 10, 'b1/task/guard/watch', []), _),
    redo(redone(b1, 15, 'b1/task/guard/report', 'b1/task/guard', [call('b1/task/guard', clear, 'Count')], none), Dict),
    shown(Dict, Abandoned), plan(b1, 15, _), next(b1, 15, First),
    report(done(b1, 20, 'b1/task/guard/clear', []), Dict1), shown(Dict1, Then),
    Found = [Abandoned, First, Then].
test('the action alone is begun again', Events == [started-'b2/task/guard/report'-r1]) :-
    open(b2), plan(b2, 0, _), next_actions(next(b2, 0), _), report(done(b2, 10, 'b2/task/guard/watch', []), _),
    redo(redone(b2, 15, 'b2/task/guard/report', 'b2/task/guard/report', [], none), _), plan(b2, 15, _), next(b2, 15, Events).
test('it is not planned beyond what is still to be found out', Found == [['b3/task/guard/clear'], 3]) :-
    open(b3), plan(b3, 0, _), next_actions(next(b3, 0), _), Place = loc('b3/task/guard', clear),
    redo(redone(b3, 10, 'b3/task/guard/watch', 'b3/task/guard', [call('b3/task/guard', look, 'Look'(r1, Place))], Place), _),
    plan(b3, 10, Dict), _{waits_for: Waits, makespan: Makespan} :< Dict, Found = [Waits, Makespan].
test('what has been found out is known then', Value == false) :-
    load_facts([effect(m, 'Look'(_, Place0), fluent(clear, way), Place0)], _),
    open(b4), plan(b4, 0, _), next_actions(next(b4, 0), _), Place = loc('b4/task/guard', clear),
    redo(redone(b4, 10, 'b4/task/guard/watch', 'b4/task/guard', [call('b4/task/guard', look, 'Look'(r1, Place))], Place), _),
    plan(b4, 10, _), next(b4, 10, _), report(done(b4, 13, 'b4/task/guard/look', [Place-false]), _),
    kept(b4, _, S), fluent_value(clear, way, Value, S).

:- end_tests(mending).

% Both robots scan and lift at once; what fails takes what runs beside it along.

:- begin_tests(abandoning, [setup(mended), cleanup(mended_gone)]).

pair(Key) :-
    load_facts([definition(m, 'Pair', F, pick(F, pick, R, 'Robot', conc([call(F, watch, 'Watch'(R)), call(F, count, 'Count')])))], _),
    open_session(request(Key, m, 'Pair', 2, 0), _).

test('what ran for the same choice is abandoned, and begins anew', Found == [['a1/task/count'], ['a1/task/watch', 'a1/task/count']]) :-
    pair(a1), plan(a1, 0, _), next_actions(next(a1, 0), _), retry(failed(a1, 5, 'a1/task/watch', 0), Dict),
    findall(Id, ( member([abandoned, Id|_], Dict.events) ), Abandoned),
    plan(a1, 5, _), next_actions(next(a1, 5), Next),
    findall(Id, member([started, Id|_], Next.events), Started),
    Found = [Abandoned, Started].

:- end_tests(abandoning).
